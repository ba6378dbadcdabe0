#pragma once

#include "core/error.h"
#include "core/options.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace nacre {

/// A table of a TOML file, read with the file and line kept for errors. Every getter
/// throws BadData "file:line: …" for a wrong type or a value out of range, and the ones
/// without a default for a missing key. Keys that nobody asked for are errors too: call
/// RejectUnknownKeys() when all of a table has been read.
class TomlTable {
 public:
  static TomlTable FromFile(const std::filesystem::path& path);
  static TomlTable FromText(const std::string& text, const std::string& origin);

  bool Has(const std::string& key) const;
  double Number(const std::string& key, Range range = {}) const;
  double Number(const std::string& key, double fallback, Range range = {}) const;
  int Integer(const std::string& key, Range range = {}) const;
  int Integer(const std::string& key, int fallback, Range range = {}) const;
  bool Boolean(const std::string& key, bool fallback) const;
  std::string Text(const std::string& key) const;
  std::string Text(const std::string& key, const std::string& fallback) const;
  /// A list of numbers; a bare number counts as a list of one.
  std::vector<double> Numbers(const std::string& key, Range range = {}) const;
  std::vector<double> Numbers(const std::string& key,
                              const std::vector<double>& fallback,
                              Range range = {}) const;
  std::vector<std::string> Texts(const std::string& key,
                                 const std::vector<std::string>& fallback) const;

  /// A nested table ([key]); the second form is empty if there is none.
  TomlTable Table(const std::string& key) const;
  std::optional<TomlTable> FindTable(const std::string& key) const;
  /// An array of tables ([[key]]), empty if there is none.
  std::vector<TomlTable> Tables(const std::string& key) const;
  /// Whether there are some, for keys that may hold something shorter too.
  bool HasTables(const std::string& key) const;

  /// Throws BadData naming the first key of this table that no getter was asked for.
  void RejectUnknownKeys() const;

  /// The error "file:line: key: message", for checks of the caller's own.
  Error At(const std::string& key, const std::string& message) const;

  /// The folder of the file, against which relative paths in it are meant.
  std::filesystem::path Folder() const;

  struct Node;  // hides the TOML library

 private:
  explicit TomlTable(std::shared_ptr<Node> node) : node_(std::move(node)) {}
  std::shared_ptr<Node> node_;
};

}  // namespace nacre
