#include "core/toml.h"

#include "core/atomic_file.h"

#include <cmath>
#include <fmt/format.h>
#include <set>
#include <toml++/toml.h>

namespace nacre {

struct TomlTable::Node {
  std::shared_ptr<const toml::table> root;  // keeps `table` alive
  const toml::table* table = nullptr;
  std::string origin;
  std::string path;  // dotted, "" for the root
  std::set<std::string> asked;

  std::string NameOf(const std::string& key) const {
    return path.empty() ? key : path + "." + key;
  }

  const toml::node* Find(const std::string& key) {
    asked.insert(key);
    return table->get(key);
  }

  const toml::node& Require(const std::string& key) {
    const toml::node* node = Find(key);
    if (node == nullptr) {
      throw BadData(fmt::format(
          "{}:{}: missing {}", origin, table->source().begin.line, NameOf(key)));
    }
    return *node;
  }

  Error ErrorAt(const toml::node& node,
                const std::string& key,
                const std::string& message) const {
    return BadData(fmt::format(
        "{}:{}: {}: {}", origin, node.source().begin.line, NameOf(key), message));
  }

  double NumberOf(const toml::node& node, const std::string& key, Range range) const {
    // "inf" in quotes is accepted, since TOML's bare inf is easily forgotten.
    const auto text = node.value_exact<std::string>();
    const std::optional<double> value =
        text && *text == "inf" ? std::optional<double>(HUGE_VAL) : node.value<double>();
    if (!value || node.is_boolean()) {
      throw ErrorAt(node, key, "expected a number");
    }
    if (!(*value >= range.min && *value <= range.max)) {
      throw ErrorAt(
          node,
          key,
          fmt::format("{} is outside [{}, {}]", *value, range.min, range.max));
    }
    return *value;
  }

  int IntegerOf(const toml::node& node, const std::string& key, Range range) const {
    const double value = NumberOf(node, key, range);
    if (value != std::floor(value) || std::abs(value) > 2e9) {
      throw ErrorAt(
          node, key, fmt::format("{} is not a whole number of this size", value));
    }
    return static_cast<int>(value);
  }

  std::string TextOf(const toml::node& node, const std::string& key) const {
    const auto value = node.value_exact<std::string>();
    if (!value) {
      throw ErrorAt(node, key, "expected text in quotes");
    }
    return *value;
  }
};

namespace {

std::shared_ptr<TomlTable::Node> Child(const TomlTable::Node& parent,
                                       const toml::table& table,
                                       const std::string& path) {
  auto node = std::make_shared<TomlTable::Node>();
  node->root = parent.root;
  node->table = &table;
  node->origin = parent.origin;
  node->path = path;
  return node;
}

}  // namespace

TomlTable TomlTable::FromFile(const std::filesystem::path& path) {
  constexpr std::uint64_t kMaxBytes = 16 << 20;
  return FromText(ReadFile(path, kMaxBytes), path.string());
}

TomlTable TomlTable::FromText(const std::string& text, const std::string& origin) {
  auto node = std::make_shared<Node>();
  try {
    node->root = std::make_shared<const toml::table>(toml::parse(text, origin));
  } catch (const toml::parse_error& e) {
    throw BadData(
        fmt::format("{}:{}: {}", origin, e.source().begin.line, e.description()));
  }
  node->table = node->root.get();
  node->origin = origin;
  return TomlTable(std::move(node));
}

bool TomlTable::Has(const std::string& key) const {
  return node_->Find(key) != nullptr;
}

double TomlTable::Number(const std::string& key, Range range) const {
  return node_->NumberOf(node_->Require(key), key, range);
}

double TomlTable::Number(const std::string& key, double fallback, Range range) const {
  return Has(key) ? Number(key, range) : fallback;
}

int TomlTable::Integer(const std::string& key, Range range) const {
  return node_->IntegerOf(node_->Require(key), key, range);
}

int TomlTable::Integer(const std::string& key, int fallback, Range range) const {
  return Has(key) ? Integer(key, range) : fallback;
}

bool TomlTable::Boolean(const std::string& key, bool fallback) const {
  if (!Has(key)) {
    return fallback;
  }
  const toml::node& node = node_->Require(key);
  const auto value = node.value_exact<bool>();
  if (!value) {
    throw node_->ErrorAt(node, key, "expected true or false");
  }
  return *value;
}

std::string TomlTable::Text(const std::string& key) const {
  return node_->TextOf(node_->Require(key), key);
}

std::string TomlTable::Text(const std::string& key, const std::string& fallback) const {
  return Has(key) ? Text(key) : fallback;
}

std::vector<double> TomlTable::Numbers(const std::string& key, Range range) const {
  const toml::node& node = node_->Require(key);
  const toml::array* array = node.as_array();
  if (array == nullptr) {
    return {node_->NumberOf(node, key, range)};
  }
  std::vector<double> values;
  for (const toml::node& element : *array) {
    values.push_back(node_->NumberOf(element, key, range));
  }
  return values;
}

std::vector<double> TomlTable::Numbers(const std::string& key,
                                       const std::vector<double>& fallback,
                                       Range range) const {
  return Has(key) ? Numbers(key, range) : fallback;
}

std::vector<std::string> TomlTable::Texts(
    const std::string& key, const std::vector<std::string>& fallback) const {
  if (!Has(key)) {
    return fallback;
  }
  const toml::node& node = node_->Require(key);
  const toml::array* array = node.as_array();
  if (array == nullptr) {
    return {node_->TextOf(node, key)};
  }
  std::vector<std::string> values;
  for (const toml::node& element : *array) {
    values.push_back(node_->TextOf(element, key));
  }
  return values;
}

TomlTable TomlTable::Table(const std::string& key) const {
  const toml::node& node = node_->Require(key);
  const toml::table* table = node.as_table();
  if (table == nullptr) {
    throw node_->ErrorAt(node, key, "expected a table");
  }
  return TomlTable(Child(*node_, *table, node_->NameOf(key)));
}

std::optional<TomlTable> TomlTable::FindTable(const std::string& key) const {
  return Has(key) ? std::optional(Table(key)) : std::nullopt;
}

std::vector<TomlTable> TomlTable::Tables(const std::string& key) const {
  std::vector<TomlTable> tables;
  if (!Has(key)) {
    return tables;
  }
  const toml::node& node = node_->Require(key);
  const toml::array* array = node.as_array();
  if (array == nullptr) {
    throw node_->ErrorAt(
        node, key, fmt::format("expected tables, written [[{}]]", key));
  }
  for (const toml::node& element : *array) {
    const toml::table* table = element.as_table();
    if (table == nullptr) {
      throw node_->ErrorAt(element, key, "expected a table");
    }
    tables.push_back(TomlTable(Child(
        *node_, *table, fmt::format("{}[{}]", node_->NameOf(key), tables.size()))));
  }
  return tables;
}

bool TomlTable::HasTables(const std::string& key) const {
  const toml::node* const node = node_->Find(key);
  return node != nullptr && node->is_array_of_tables();
}

void TomlTable::RejectUnknownKeys() const {
  for (const auto& [key, value] : *node_->table) {
    const std::string name(key.str());
    if (!node_->asked.contains(name)) {
      std::string known;
      for (const std::string& asked : node_->asked) {
        known += (known.empty() ? "" : ", ") + asked;
      }
      throw node_->ErrorAt(value, name, "unknown here; known are: " + known);
    }
  }
}

Error TomlTable::At(const std::string& key, const std::string& message) const {
  const toml::node* node = node_->table->get(key);
  return node_->ErrorAt(node != nullptr ? *node : *node_->table, key, message);
}

std::filesystem::path TomlTable::Folder() const {
  return std::filesystem::path(node_->origin).parent_path();
}

}  // namespace nacre
