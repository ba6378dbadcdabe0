#pragma once

#include "core/png.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace nacre::cli::report {

/// Text as HTML: &, <, > and quotes escaped.
std::string Escape(std::string_view text);

/// As Escape, with R_d as it is printed.
std::string Prose(std::string_view text);

/// RFC 4648.
std::string Base64(std::string_view bytes);

/// An <img> with the PNG inline. Enlarged pixels stay sharp with `css_class` "pixels".
std::string ImageTag(const std::string& png_bytes,
                     const std::string& alt,
                     const std::string& css_class = "");
std::string ImageTag(const PngImage& image,
                     const std::string& alt,
                     const std::string& css_class = "");

/// A numbered figure is what a reader can refer to; numbers are given by the page's
/// style sheet. `body` and `caption` are HTML.
std::string Figure(const std::string& body,
                   const std::string& caption,
                   const std::string& css_class = "");

/// Figures beside each other as far as the page is wide enough.
std::string Row(const std::vector<std::string>& figures);

/// Name and value, both HTML.
struct Fact {
  std::string name;
  std::string value;
};
std::string FactList(const std::vector<Fact>& facts);

/// Cells are HTML; columns from `first_number_column` on are set as numbers.
std::string Table(const std::vector<std::string>& head,
                  const std::vector<std::vector<std::string>>& rows,
                  std::size_t first_number_column = 1);

/// What a check found: a sign, not by colour alone, and a sentence (HTML).
std::string Check(bool good, const std::string& sentence);

/// `title` is HTML, `origin` plain text.
std::string Section(const std::string& title,
                    const std::string& origin,
                    const std::string& body);

/// The whole document. `lead` is HTML; `provenance`, JSON, is in its head, unseen.
std::string Page(const std::string& title,
                 const std::string& lead,
                 const std::string& body,
                 const std::string& provenance);

/// A number to `digits` significant ones, powers of ten as such: 1.23 × 10⁻⁵. HTML.
std::string Number(double value, int digits = 3);
/// "4.53 %"
std::string Percent(double fraction);
/// "1.5 MB"
std::string Bytes(double bytes);

}  // namespace nacre::cli::report
