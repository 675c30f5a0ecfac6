// Whole prints as motion of joints, read back and compared place by place.
#include "unflex/flow/translate.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <sstream>
#include <string>

#include "paths.hpp"
#include "translating.hpp"
#include "unflex/core/own_marks.hpp"
#include "unflex/machine/as_printer.hpp"
#include "unflex/machine/kinematic_machine.hpp"

namespace unflex::flow {
namespace {

using kinematics::Point;
using ::testing::StartsWith;

std::string data(const std::string& name) {
  std::ifstream file(std::string(test_paths::kData) + "/" + name, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

machine::Settings settings_of(const std::string& type) {
  return machine::parse("[kinematics]\ntype = \"" + type +
                            "\"\nhome_mm = [0, 0, 0]\noffset_mm = [-85.5, -90, 230]\n",
                        "p.toml", {})
      .value();
}

Result<std::string> whole(const std::string& print, const machine::Settings& settings,
                          TranslatedPrint* told = nullptr) {
  std::string text;
  SilentProgress progress;
  return translate(*memory_store(print), "in.gcode", settings, progress,
                   [&](std::string_view block) {
                     text += block;
                     return Status{};
                   })
      .map([&](const TranslatedPrint& result) {
        if (told != nullptr) {
          *told = result;
        }
        return text;
      });
}

// The start of a segment in the tool's coordinates.
void expect_same_path(const std::string& print, const std::string& text,
                      const machine::Settings& settings) {
  const kinematics::Machine machine = machine::kinematic_machine(settings);
  const auto options = machine::interpreter_options(settings);
  const auto sliced = play(print, options, {});
  const auto written = play(text, options, to_joints(machine, {}).value());
  double sliced_s = 0.0;
  double written_s = 0.0;
  std::vector<gcode::Segment> pieces;
  std::vector<gcode::Segment> lines;
  for (const Played& move : sliced) {
    pieces.insert(pieces.end(), move.segments.begin(), move.segments.end());
    sliced_s += move.duration_s;
  }
  for (const Played& move : written) {
    lines.insert(lines.end(), move.segments.begin(), move.segments.end());
    written_s += move.duration_s;
  }
  ASSERT_EQ(pieces.size(), lines.size());
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const Point start = to_point(machine, place_of(lines[i].start_mm)).value();
    const Point end = to_point(machine, place_of(lines[i].end_mm)).value();
    ASSERT_LT(distance_mm(start, place_of(pieces[i].start_mm)), 1e-4) << lines[i].line;
    ASSERT_LT(distance_mm(end, place_of(pieces[i].end_mm)), 1e-4) << lines[i].line;
  }
  EXPECT_NEAR(sliced.back().e_mm, written.back().e_mm, 1e-6);
  EXPECT_GT(written.back().e_mm, 1.0);
  EXPECT_NEAR(written_s, sliced_s, 1e-4 * sliced_s);
}

TEST(Translate, DrawsThePathOfAPrintLineByLine) {
  const std::string print = data("pipeline_cube20.gcode");
  for (const std::string type : {"tripteron", "corexy"}) {
    const machine::Settings settings = settings_of(type);
    TranslatedPrint told;
    const Result<std::string> text = whole(print, settings, &told);
    ASSERT_TRUE(text) << to_string(text.error());
    EXPECT_EQ(told.moves, told.lines);
    EXPECT_THAT(told.warnings, testing::IsEmpty());
    // Nothing but the mark is added.
    EXPECT_EQ(lines_of(*text), lines_of(print) + 1);
    EXPECT_NE(text->find(kJointsMark), std::string::npos);
    expect_same_path(print, *text, settings);
    std::istringstream before(print);
    std::istringstream after(*text);
    std::string other;
    for (std::string line; std::getline(before, line) && std::getline(after, other);) {
      EXPECT_EQ(line.starts_with("G1 "), other.starts_with("G1 "));
      EXPECT_TRUE(line.starts_with("G1 ") || line == other) << line;
      EXPECT_EQ(line.substr(std::min(line.find(';'), line.size())),
                other.substr(std::min(other.find(';'), other.size())));
    }
    EXPECT_THAT(to_string(whole(*text, settings).error()),
                StartsWith("in.gcode:" + std::to_string(lines_of(*text)) +
                           ": this file was already translated"));
  }
}

TEST(Translate, DrawsThePathOfArcs) {
  std::istringstream sliced(data("pipeline_washer_arcs.gcode"));
  std::string print;
  for (std::string line; std::getline(sliced, line);) {
    print += line.starts_with("START_PRINT")        ? "G28\n"
             : line.starts_with("SET_GCODE_OFFSET") ? "\n"
                                                    : line + "\n";
  }
  const machine::Settings settings = settings_of("tripteron");
  TranslatedPrint told;
  const Result<std::string> text = whole(print, settings, &told);
  ASSERT_TRUE(text) << to_string(text.error());
  EXPECT_GT(told.lines, told.moves);
  expect_same_path(print, *text, settings);
}

TEST(Translate, StopsWhenItIsCancelled) {
  class Stopped final : public Progress {
   public:
    void update(std::string_view, double) override {}
    [[nodiscard]] bool cancelled() const override { return true; }
  };
  Stopped progress;
  const auto result = translate(*memory_store("G28\n"), "in.gcode", settings_of("tripteron"),
                                progress, [](std::string_view) { return Status{}; });
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, ErrorKind::internal);
}

TEST(Translate, TakesAFirmwareThatKnowsNoMatrix) {
  const std::string keys = "printer.firmware = \"marlin\"\nkinematics.type = \"tripteron\"\n";
  EXPECT_FALSE(machine::parse(keys, "p.toml", {}));
  machine::Sources sources;
  sources.overrides = {"printer.firmware=marlin", "kinematics.type=tripteron"};
  EXPECT_FALSE(machine::load(sources));
  sources.is_firmware_plain = true;
  EXPECT_TRUE(machine::load(sources));
}

}  // namespace
}  // namespace unflex::flow
