#include "cli/report/html.h"

#include "cli/report/style.h"
#include "core/version.h"

#include <array>
#include <cmath>
#include <fmt/format.h>

namespace nacre::cli::report {

std::string Escape(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string Prose(std::string_view text) {
  constexpr std::string_view kSymbol = "R_d";
  std::string out = Escape(text);
  for (auto at = out.find(kSymbol); at != std::string::npos;
       at = out.find(kSymbol, at)) {
    out.replace(at, kSymbol.size(), "R<sub>d</sub>");
  }
  return out;
}

std::string Base64(std::string_view bytes) {
  constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t n = 0; n < bytes.size(); n += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = group << 8 |
              (n + k < bytes.size() ? static_cast<unsigned char>(bytes[n + k]) : 0u);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      const bool filled = n + k <= bytes.size();
      out += filled ? kDigits[group >> (18 - 6 * k) & 63u] : '=';
    }
  }
  return out;
}

std::string ImageTag(const std::string& png_bytes,
                     const std::string& alt,
                     const std::string& css_class) {
  return fmt::format(R"(<img class="{}" alt="{}" src="data:image/png;base64,{}">)",
                     css_class,
                     Escape(alt),
                     Base64(png_bytes));
}

std::string ImageTag(const PngImage& image,
                     const std::string& alt,
                     const std::string& css_class) {
  return ImageTag(EncodePng(image, 6), alt, css_class);
}

std::string Figure(const std::string& body,
                   const std::string& caption,
                   const std::string& css_class) {
  return fmt::format(
      "<figure class=\"{}\">\n{}\n<figcaption>{}</figcaption></figure>\n",
      css_class,
      body,
      caption);
}

std::string Row(const std::vector<std::string>& figures) {
  std::string out = "<div class=\"row\">\n";
  for (const std::string& figure : figures) {
    out += figure;
  }
  return out + "</div>\n";
}

std::string FactList(const std::vector<Fact>& facts) {
  std::string out = "<dl>\n";
  for (const Fact& fact : facts) {
    out += fmt::format("<div><dt>{}</dt><dd>{}</dd></div>\n", fact.name, fact.value);
  }
  return out + "</dl>\n";
}

std::string Table(const std::vector<std::string>& head,
                  const std::vector<std::vector<std::string>>& rows,
                  std::size_t first_number_column) {
  const auto cell = [&](const char* tag, std::size_t column, const std::string& text) {
    return fmt::format("<{0}{1}>{2}</{0}>",
                       tag,
                       column >= first_number_column ? " class=\"n\"" : "",
                       text);
  };
  std::string out = "<div class=\"scroll\"><table><thead><tr>";
  for (std::size_t c = 0; c < head.size(); ++c) {
    out += cell("th", c, head[c]);
  }
  out += "</tr></thead><tbody>\n";
  for (const std::vector<std::string>& row : rows) {
    out += "<tr>";
    for (std::size_t c = 0; c < row.size(); ++c) {
      out += cell("td", c, row[c]);
    }
    out += "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

std::string Check(bool good, const std::string& sentence) {
  return fmt::format("<p class=\"check {}\"><b>{}</b><span>{}</span></p>\n",
                     good ? "good" : "bad",
                     good ? "✓" : "!",
                     sentence);
}

std::string Section(const std::string& title,
                    const std::string& origin,
                    const std::string& body) {
  return fmt::format("<section>\n<header><h2>{}</h2>{}</header>\n{}</section>\n",
                     title,
                     origin.empty() ? "" : "<code>" + Escape(origin) + "</code>",
                     body);
}

std::string Page(const std::string& title,
                 const std::string& lead,
                 const std::string& body,
                 const std::string& provenance) {
  return fmt::format(R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8">
<meta name="nacre.provenance" content="{5}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{0}</title>
<style>{1}</style></head>
<body><main>
<h1>{0}</h1>
{2}
{3}<footer>nacre {4}</footer>
</main></body></html>
)",
                     Escape(title),
                     StyleSheet(),
                     lead.empty() ? "" : "<p class=\"lead\">" + lead + "</p>",
                     body,
                     Version(),
                     Escape(provenance));
}

std::string Number(double value, int digits) {
  if (!std::isfinite(value)) {
    return std::isnan(value) ? "–" : value > 0 ? "∞" : "−∞";
  }
  if (value == 0) {
    return "0";
  }
  const int exponent = static_cast<int>(std::floor(std::log10(std::abs(value))));
  std::string text;
  if (exponent < -3 || exponent >= 6) {
    text = fmt::format("{:.{}f} × 10<sup>{}</sup>",
                       value / std::pow(10.0, exponent),
                       digits - 1,
                       exponent);
  } else {
    text = fmt::format("{:.{}f}", value, std::max(0, digits - 1 - exponent));
  }
  std::string out;  // with a proper minus sign
  for (const char c : text) {
    out += c == '-' ? std::string("−") : std::string(1, c);
  }
  return out;
}

std::string Percent(double fraction) {
  return Number(100 * fraction) + " %";
}

std::string Bytes(double bytes) {
  constexpr std::array kUnits{"B", "kB", "MB", "GB", "TB"};
  std::size_t unit = 0;
  while (bytes >= 999.5 && unit + 1 < kUnits.size()) {
    bytes /= 1000;
    ++unit;
  }
  return fmt::format("{:.{}f} {}",
                     bytes,
                     unit == 0 || bytes >= 100 ? 0
                     : bytes >= 10             ? 1
                                               : 2,
                     kUnits[unit]);
}

}  // namespace nacre::cli::report
