#include "unflex/report/html_page.hpp"

#include <fmt/core.h>

#include "assets.hpp"

namespace unflex::report {
namespace {

// The page never loads or runs anything but what the file itself contains.
constexpr std::string_view kPolicy =
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:";

constexpr std::string_view kReplacement = "\xef\xbf\xbd";

// Length of the UTF-8 sequence at the beginning of the text; 0 if there is none.
std::size_t sequence_length(std::string_view text) {
  const auto byte = [&](std::size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U;
  };
  const auto continues = [&](std::size_t i) { return (byte(i) & 0xC0U) == 0x80U; };
  const unsigned lead = byte(0);
  const unsigned second = byte(1);
  if (lead < 0x80U) {
    return 1;
  }
  if (lead >= 0xC2U && lead <= 0xDFU && continues(1)) {
    return 2;
  }
  // Reject overlong forms, surrogates and code points above U+10FFFF.
  if ((lead & 0xF0U) == 0xE0U && continues(1) && continues(2)) {
    return (lead == 0xE0U && second < 0xA0U) || (lead == 0xEDU && second >= 0xA0U) ? 0 : 3;
  }
  if (lead >= 0xF0U && lead <= 0xF4U && continues(1) && continues(2) && continues(3)) {
    return (lead == 0xF0U && second < 0x90U) || (lead == 0xF4U && second >= 0x90U) ? 0 : 4;
  }
  return 0;
}

std::string_view escaped(std::string_view character) {
  switch (character.front()) {
    case '&':
      return "&amp;";
    case '<':
      return "&lt;";
    case '>':
      return "&gt;";
    case '"':
      return "&quot;";
    case '\'':
      return "&#39;";
    default:
      break;
  }
  const auto code = static_cast<unsigned char>(character.front());
  const bool control = (code < 0x20U && code != '\n' && code != '\t') || code == 0x7FU;
  return control ? kReplacement : character;
}

}  // namespace

std::string escape_html(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = sequence_length(text);
    result += length == 0 ? kReplacement : escaped(text.substr(0, length));
    text.remove_prefix(length == 0 ? 1 : length);
  }
  return result;
}

std::string term(std::string_view word, std::string_view explanation) {
  return fmt::format(R"(<span class="term" tabindex="0" data-tip="{}">{}</span>)",
                     escape_html(explanation), escape_html(word));
}

std::string embedded_json(std::string_view id, const Json& json) {
  std::string text = json.dump(-1, ' ', /*ensure_ascii=*/false, Json::error_handler_t::replace);
  std::string safe;
  safe.reserve(text.size());
  for (const char c : text) {
    if (c == '<') {
      safe += "\\u003c";
    } else {
      safe += c;
    }
  }
  return fmt::format("<script type=\"application/json\" id=\"{}\">{}</script>\n", escape_html(id),
                     safe);
}

std::string html_page(const Page& page) {
  const std::string title = escape_html(page.title);
  return fmt::format(R"(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<link rel="icon" href="data:,">
<title>{title}</title>
<style>
{colours}
{frame_style}{style}</style>
</head>
<body>
<a class="skip" href="#main">Skip to the report</a>
<header class="top"><span class="mark">unflex</span><h1>{title}</h1>
<button id="theme" type="button" aria-label="Colours: automatic">◐ auto</button></header>
<main id="main">
{body}</main>
<script>
{frame_script}{script}</script>
</body>
</html>
)",
                     fmt::arg("policy", kPolicy), fmt::arg("title", title),
                     fmt::arg("colours", assets::colours_css),
                     fmt::arg("frame_style", assets::page_css), fmt::arg("style", page.style),
                     fmt::arg("body", page.body), fmt::arg("frame_script", assets::page_js),
                     fmt::arg("script", page.script));
}

}  // namespace unflex::report
