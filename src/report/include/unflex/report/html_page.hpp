// The frame of every HTML page the program writes: one file that needs nothing else, light and
// dark, with the colours and the small parts that pages share.
//
// For pages to use (src/report/assets/page.css):
//   colours       --bg --surface --raised --text --muted --line --accent; of curves, told apart by
//                 the colour-blind: --series-1 to --series-6; --before and --after; each has a
//                 light and a dark form
//   <section class="card">            a block of the page
//   <div class="figures">, <dl class="facts">, <table class="data">, <details>
//   unflex.theme(callback)            called when light and dark change, for what is drawn by hand
//   unflex.colour("--after")          the colour's present value
#pragma once

#include <string>
#include <string_view>

#include "unflex/report/json_parts.hpp"

namespace unflex::report {

// For text and attributes: & < > " ' become entities; control characters and invalid UTF-8 become
// U+FFFD. Whatever comes from outside the program must pass through this or embedded_json().
[[nodiscard]] std::string escape_html(std::string_view text);

// A word with an explanation that shows when it is pointed at, touched or reached by keyboard.
// Both are plain text.
[[nodiscard]] std::string term(std::string_view word, std::string_view explanation);

// <script type="application/json" id="…">: data for the page's script. Nothing in it can end the
// element.
[[nodiscard]] std::string embedded_json(std::string_view id, const Json& json);

struct Page {
  std::string title;   // plain text
  std::string style;   // CSS, added to the frame's
  std::string body;    // HTML of <main>
  std::string script;  // JavaScript, run after the frame's when the page is there
};

[[nodiscard]] std::string html_page(const Page& page);

}  // namespace unflex::report
