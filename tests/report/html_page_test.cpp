#include "unflex/report/html_page.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace unflex::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kHostile = "</script><script>alert('x')</script>\"&<!--";

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++found;
  }
  return found;
}

TEST(HtmlEscape, LeavesNoCharacterThatMeansSomethingInHtml) {
  EXPECT_EQ(escape_html(R"(<a href="x" title='y'>&amp;)"),
            "&lt;a href=&quot;x&quot; title=&#39;y&#39;&gt;&amp;amp;");
  EXPECT_EQ(escape_html("µm → 5 °C, 部品 🛠\n\t"), "µm → 5 °C, 部品 🛠\n\t");
}

TEST(HtmlEscape, ReplacesWhatIsNoText) {
  EXPECT_EQ(escape_html("caf\xe9"), "caf\xef\xbf\xbd");
  EXPECT_EQ(escape_html(std::string("a\0b\x1b\x7f", 5)),
            "a\xef\xbf\xbd"
            "b\xef\xbf\xbd\xef\xbf\xbd");
  // Overlong, a surrogate, above U+10FFFF, cut short.
  for (const char* const text : {"\xc0\xbc", "\xe0\x80\xbc", "\xed\xa0\x80", "\xf4\x90\x80\x80",
                                 "\xf0\x9f\x98", "\xe2\x82"}) {
    EXPECT_THAT(escape_html(text), ::testing::MatchesRegex("(\xef\xbf\xbd)+")) << text;
  }
}

TEST(EmbeddedJson, CannotEndItsElement) {
  const std::string element = embedded_json("data", {{"name", kHostile}, {kHostile, 1}});
  EXPECT_EQ(count(element, "<"), 2U);
  EXPECT_THAT(element, ::testing::EndsWith("</script>\n"));
  const std::size_t begin = element.find('>') + 1;
  const Json read = Json::parse(element.substr(begin, element.rfind("</") - begin));
  EXPECT_EQ(read["name"], kHostile);
  EXPECT_EQ(read[kHostile], 1);
}

TEST(HtmlPage, EscapesItsTitle) {
  const std::string page = html_page({.title = kHostile, .style = "", .body = "", .script = ""});
  EXPECT_FALSE(page.find("<script>alert") != std::string::npos);
  EXPECT_EQ(count(page, "&lt;/script&gt;"), 4U);
}

TEST(HtmlPage, HoldsWhatItIsGivenAndNeedsNothingElse) {
  const std::string page =
      html_page({.title = "t", .style = "b{}", .body = "<p>x</p>", .script = "f();"});
  EXPECT_THAT(page, ::testing::StartsWith("<!DOCTYPE html>\n"));
  EXPECT_THAT(page, HasSubstr("b{}</style>"));
  EXPECT_THAT(page, HasSubstr("<p>x</p></main>"));
  EXPECT_THAT(page, HasSubstr("f();</script>"));
  EXPECT_THAT(page, Not(HasSubstr("http://")));
  EXPECT_THAT(page, Not(HasSubstr("https://")));
  EXPECT_THAT(page, HasSubstr("default-src 'none'"));
}

TEST(Term, KeepsWordAndExplanationApart) {
  EXPECT_EQ(term("a<b", "\"x\""),
            R"(<span class="term" tabindex="0" data-tip="&quot;x&quot;">a&lt;b</span>)");
}

}  // namespace
}  // namespace unflex::report
