// The page docs/configuration.md agrees with the program.

#include "unflex/machine/keys.hpp"

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <set>

#include "paths.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::machine {
namespace {

using ::testing::HasSubstr;

std::string documentation() {
  std::ifstream page(std::string(test_paths::kDocs) + "/configuration.md");
  return {std::istreambuf_iterator<char>(page), {}};
}

// The key's row in the page's table.
std::string row_of(const KeyDescription& key) {
  return fmt::format("| `{}` | {} | {} | {} | {} |\n", key.name, key.default_value, key.unit,
                     key.range, key.meaning);
}

TEST(ConfigurationPage, HasTheRowOfEveryKeyInOrder) {
  const std::string page = documentation();
  std::size_t from = 0;
  for (const KeyDescription& key : describe_keys()) {
    const std::size_t at = page.find(row_of(key), from);
    EXPECT_NE(at, std::string::npos) << "missing or out of order:\n" << row_of(key);
    from = at == std::string::npos ? from : at;
  }
}

TEST(ConfigurationPage, HasNoRowOfAnotherKey) {
  const std::string page = documentation();
  std::size_t rows_on_page = 0;
  for (std::size_t at = page.find("\n| `"); at != std::string::npos;
       at = page.find("\n| `", at + 1)) {
    ++rows_on_page;
  }
  EXPECT_EQ(rows_on_page, describe_keys().size());
}

TEST(ConfigurationPage, ShowsAnExampleThatIsValid) {
  const std::string page = documentation();
  const std::string fence = "```toml\n";
  const std::size_t from = page.find(fence);
  ASSERT_NE(from, std::string::npos);
  const std::size_t start = from + fence.size();
  const std::string example = page.substr(start, page.find("```", start) - start);
  const Result<Settings> settings = parse(example, "configuration.md", {});
  EXPECT_TRUE(settings) << to_string(settings.error());
}

TEST(Keys, AreUniqueAndCarryTheirUnit) {
  const std::map<std::string, std::string> suffixes = {
      {"mm", "_mm"},         {"mm/s", "_mm_s"},   {"mm/s²", "_mm_s2"}, {"mm/s³", "_mm_s3"},
      {"mm²", "_mm2"},       {"Hz", "_hz"},       {"g", "_g"},         {"N/mm", "_n_mm"},
      {"N·s/mm", "_n_s_mm"}, {"s", "_s"},         {"ms", "_ms"},       {"µm", "_um"},
      {"mm³/s", "_mm3_s"},   {"1/s", "_per_s"},   {"1/mm", "_per_mm"}, {"°C", "_c"},
      {"W", "_w"},           {"g/cm³", "_g_cm3"}, {"°", "_deg"},       {"", ""}};
  std::set<std::string> seen;
  for (const KeyDescription& key : describe_keys()) {
    EXPECT_TRUE(seen.insert(key.name).second) << key.name;
    ASSERT_TRUE(suffixes.contains(key.unit)) << key.unit;
    EXPECT_THAT(key.name, ::testing::EndsWith(suffixes.at(key.unit)));
    EXPECT_FALSE(key.default_value.empty()) << key.name;
    EXPECT_FALSE(key.meaning.empty()) << key.name;
  }
}

TEST(Keys, CanAllBeSetToWhatTheyAreByDefault) {
  for (const SettingRow& row : rows(*load(std::nullopt, {}))) {
    if (!row.value.empty()) {
      const Result<Settings> settings = load(std::nullopt, {row.key + "=" + row.value});
      EXPECT_TRUE(settings) << to_string(settings.error());
    }
  }
}

}  // namespace
}  // namespace unflex::machine
