#include "unflex/gcode/command.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <string_view>

namespace unflex::gcode {
namespace {

// "X=1 Y Z=2.5": the words of a line, for comparison at a glance.
std::string words(std::string_view line) {
  std::string text;
  for (const Word& word : parse(line).words) {
    text += text.empty() ? "" : " ";
    text += word.letter;
    if (word.value) {
      text += '=';
      text += ::testing::PrintToString(*word.value);
    }
  }
  return text;
}

std::string with_checksum(const std::string& text) {
  int sum = 0;
  for (const char c : text) {
    sum ^= static_cast<unsigned char>(c);
  }
  return text + "*" + std::to_string(sum);
}

TEST(Parse, FindsNothingInBlanksAndComments) {
  for (const char* line :
       {"", "   ", "\t\r", "; G1 X1", "  ;", "(G1 X1)", "(a) (b) ; c", "(open G1"}) {
    const Command command = parse(line);
    EXPECT_EQ(command.kind, CommandKind::none) << line;
    EXPECT_TRUE(command.words.empty()) << line;
  }
  EXPECT_EQ(parse("; TYPE:Infill").comment, " TYPE:Infill");
  EXPECT_EQ(parse("(a) (b) ; c").comment, " c");
}

TEST(Parse, ReadsWordsHoweverTheyAreSpaced) {
  for (const char* line : {"G1 X1 Y-2.5 E.25 F1200", "g1x1y-2.5e.25f1200", "G1X1Y-2.5E.25F1200",
                           "G 1 X 1 Y -2.5 E .25 F 1200", "\tG01\tX1.0\tY-2.50 E+.25 F1200.000 ",
                           "G1 (to) X1 (the) Y-2.5(right)E.25 F1200 (unclosed",
                           "G1 X1 Y-2.5 E.25 F1200;comment X9", "(first) G1 X1Y-2.5 E.25F1200"}) {
    const Command command = parse(line);
    EXPECT_TRUE(command.is('G', 1)) << line << ": " << command.problem;
    EXPECT_EQ(words(line), "X=1 Y=-2.5 E=0.25 F=1200") << line;
  }
}

TEST(Parse, TellsBareLettersFromThoseWithAValue) {
  EXPECT_EQ(words("G28 X Y0 W"), "X Y=0 W");
  EXPECT_EQ(words("G28XY"), "X Y");
  const Command command = parse("G28 X Y0");
  EXPECT_TRUE(command.has('X'));
  EXPECT_EQ(command.value('X'), std::nullopt);
  EXPECT_EQ(command.value('Y'), 0.0);
  EXPECT_FALSE(command.has('Z'));
  EXPECT_EQ(command.value('Z'), std::nullopt);
}

TEST(Parse, LetsALaterWordOverrideAnEarlierOne) {
  EXPECT_EQ(parse("G1 X1 Y2 X3").value('X'), 3.0);
  EXPECT_EQ(parse("G28 X1 X").value('X'), std::nullopt);
}

TEST(Parse, ReadsNumbersAndSubnumbersOfCommands) {
  EXPECT_EQ(parse("M862.3 P1").number, 862);
  EXPECT_EQ(parse("M862.3 P1").subnumber, 3);
  EXPECT_EQ(words("M862.3 P1"), "P=1");
  EXPECT_EQ(parse("T0").letter, 'T');
  EXPECT_EQ(parse("t12").number, 12);
  EXPECT_EQ(parse("G92E0").subnumber, -1);
  EXPECT_EQ(words("G92E0"), "E=0");
  EXPECT_EQ(words("G10 S210 P0"), "S=210 P=0");
  EXPECT_EQ(parse("G1009 ; purge").number, 1009);
}

TEST(Parse, GivesArgumentsAndComment) {
  const Command command = parse("G1  X1 Y2  ; external perimeter ");
  EXPECT_EQ(command.arguments, "X1 Y2");
  EXPECT_EQ(command.comment, " external perimeter ");
  EXPECT_EQ(parse("M84").arguments, "");
}

TEST(Parse, TakesMessagesAsText) {
  for (const char* line : {"M117 Layer 3 of X10*7", "m118 Layer 3 of X10*7", "M23 Layer 3 of X10*7",
                           "M117Layer 3 of X10*7", "M117 Layer 3 of X10*7 ; remark"}) {
    const Command command = parse(line);
    EXPECT_EQ(command.kind, CommandKind::traditional) << line;
    EXPECT_TRUE(command.words.empty()) << line;
    EXPECT_EQ(command.arguments, "Layer 3 of X10*7") << line;
  }
  EXPECT_EQ(parse("M117 a;b").comment, "b");
  const std::string line = with_checksum("N3 M117 5*3 is 15");
  const Command numbered = parse(line);
  EXPECT_EQ(numbered.arguments, "5*3 is 15");
  EXPECT_EQ(numbered.kind, CommandKind::traditional);
}

TEST(Parse, ReadsNoWordsInsideQuotes) {
  EXPECT_EQ(words("M862.3 P \"MK3S X1;Y2\" ; check"), "P");
  EXPECT_EQ(parse("M862.3 P \"MK3S X1;Y2\" ; check").comment, " check");
  EXPECT_EQ(words("M98 P\"/macros/x1\" S5"), "P S=5");
  EXPECT_EQ(parse("M291 P\"not closed").kind, CommandKind::traditional);
}

TEST(Parse, ForgivesTextInMCodesOnly) {
  EXPECT_EQ(parse("M486 ACube-1.stl id:0").kind, CommandKind::traditional);
  EXPECT_EQ(parse("M104 S2x0 =5").kind, CommandKind::traditional);
  EXPECT_EQ(words("M204 S1..2 T5"), "S T=5");
  for (const char* line : {"G1 X1..2", "G1 X--1", "G1 X1 ?", "G1 X1=2", "G1 X1 2", "G1 X{a}",
                           "G1 X1,5", "G1 X\"1", "G1 X1*x", "T0 #"}) {
    const Command command = parse(line);
    EXPECT_EQ(command.kind, CommandKind::malformed) << line;
    EXPECT_THAT(command.problem, ::testing::HasSubstr("cannot read '")) << line;
  }
  EXPECT_EQ(parse("G1 X1..2 Y3").problem, "cannot read 'X1..2'");
}

TEST(Parse, CallsAnythingThatBeginsNoCommandMalformed) {
  for (const char* line :
       {"?", "%", "123", "=5", "-G1", "G", "T?", "G-1", "M.5", "G1.", "G1.X2", "Hello, world",
        "<html>", "G99999999999", "\xef\xbb\xbfG1 X1", "*5 G1"}) {
    const Command command = parse(line);
    EXPECT_EQ(command.kind, CommandKind::malformed) << line;
    EXPECT_FALSE(command.problem.empty()) << line;
  }
}

TEST(Parse, TakesNumbersThatNoPrinterHoldsForNone) {
  EXPECT_EQ(parse("G1 X10000000001").kind, CommandKind::malformed);
  EXPECT_EQ(parse("G1 X-" + std::string(300, '9')).kind, CommandKind::malformed);
  EXPECT_EQ(words("M221 S" + std::string(300, '9')), "S");
  EXPECT_EQ(words("M200 D0." + std::string(40, '0') + "1"), "D=0");
  EXPECT_EQ(words("G1 X10000000000 F0.0000000001"), "X=1e+10 F=1e-10");
}

TEST(Parse, ChecksLineNumbersAndChecksums) {
  const std::string line = with_checksum("N12 G1 X1 Y2 ") + " ; remark";
  const Command command = parse(line);
  EXPECT_TRUE(command.is('G', 1)) << command.problem;
  EXPECT_EQ(command.line_number, 12);
  EXPECT_EQ(command.checksum,
            'N' ^ '1' ^ '2' ^ ' ' ^ 'G' ^ '1' ^ ' ' ^ 'X' ^ '1' ^ ' ' ^ 'Y' ^ '2' ^ ' ');
  EXPECT_EQ(command.arguments, "X1 Y2");
  EXPECT_EQ(command.comment, " remark");
  EXPECT_EQ(words(with_checksum("N12 G1 X1 Y2")), "X=1 Y=2") << "N is no word of the command";
  EXPECT_TRUE(parse("   " + with_checksum("n7g28")).is('G', 28)) << "leading blanks do not count";
  EXPECT_TRUE(parse("N 5 G1 X1").is('G', 1));
  EXPECT_EQ(parse(with_checksum("M105")).kind, CommandKind::traditional);
  EXPECT_EQ(words(with_checksum("N0 M110 N7")), "N=7");
  EXPECT_EQ(parse("N3 ; only a number").kind, CommandKind::none);
  EXPECT_EQ(parse(with_checksum("N3")).kind, CommandKind::none);
}

TEST(Parse, SaysWhichChecksumIsRight) {
  const Command command = parse("N12 G1 X1*1");
  EXPECT_EQ(command.kind, CommandKind::malformed);
  const std::string right = with_checksum("N12 G1 X1");
  EXPECT_EQ(command.problem,
            "the checksum is 1 but should be " + right.substr(right.find('*') + 1));
  EXPECT_EQ(parse("M105*999").kind, CommandKind::malformed);
  EXPECT_EQ(parse("N4 G28*99999999999").kind, CommandKind::malformed);
  EXPECT_EQ(parse("N1.5 G1 X1").kind, CommandKind::malformed);
  EXPECT_EQ(parse("N99999999999999999999 G1").kind, CommandKind::malformed);
}

TEST(Parse, ReadsExtendedCommands) {
  const Command command = parse("print_start Bed=60 EXTRUDER=215.5 NAME=a=b ; go");
  EXPECT_EQ(command.kind, CommandKind::extended);
  EXPECT_EQ(command.name, "PRINT_START");
  EXPECT_EQ(command.arguments, "Bed=60 EXTRUDER=215.5 NAME=a=b");
  EXPECT_EQ(command.comment, " go");
  EXPECT_EQ(command.parameter("BED"), "60");
  EXPECT_EQ(command.parameter("EXTRUDER"), "215.5");
  EXPECT_EQ(command.parameter("NAME"), "a=b");
  EXPECT_EQ(command.parameter("TOOL"), std::nullopt);
  EXPECT_EQ(parse("PRINT_END").name, "PRINT_END");
  EXPECT_EQ(parse("_PARK2").name, "_PARK2");
  EXPECT_EQ(parse("E_STOP").name, "E_STOP");
  EXPECT_EQ(parse("Tx").name, "TX");
  EXPECT_EQ(parse("NOZZLE_WIPE").name, "NOZZLE_WIPE");
  EXPECT_EQ(parse("SET_PIN PIN=a PIN=b").parameter("PIN"), "b");
  EXPECT_EQ(parse("SET_PIN PIN=").parameter("PIN"), "");
}

TEST(Parse, TakesQuotesOffAsAShellWould) {
  EXPECT_EQ(parse("RESPOND MSG=\"a; b # c\" TYPE=echo;d").parameter("MSG"), "a; b # c");
  EXPECT_EQ(parse("RESPOND MSG=\"a; b # c\" TYPE=echo;d").parameter("TYPE"), "echo");
  EXPECT_EQ(parse("RESPOND MSG=\"a; b # c\" TYPE=echo;d").comment, "d");
  EXPECT_EQ(parse("RESPOND MSG='it is \"so\"'").parameter("MSG"), "it is \"so\"");
  EXPECT_EQ(parse("RESPOND MSG=\"it's\"").parameter("MSG"), "it's");
  EXPECT_EQ(parse("RESPOND \"MSG=a b\"").parameter("MSG"), "a b");
  EXPECT_EQ(parse(R"(RESPOND MSG=a\ b\"c)").parameter("MSG"), "a b\"c");
  EXPECT_EQ(parse(R"(RESPOND MSG="a\"b\\c\d")").parameter("MSG"), R"(a"b\c\d)");
  EXPECT_EQ(parse(R"(RESPOND MSG='a\\b')").parameter("MSG"), R"(a\\b)");
  EXPECT_EQ(parse("SET_LED LED=a # red").comment, " red");
  EXPECT_EQ(parse("RESPOND MSG=it's").problem, "a quote is not closed");
  EXPECT_EQ(parse("RESPOND MSG=\"a").problem, "a quote is not closed");
  EXPECT_EQ(parse("RESPOND MSG=a\\").problem, "a quote is not closed");
}

TEST(Parse, WantsKeyAndValueInExtendedCommands) {
  EXPECT_EQ(parse("The quick brown fox").problem, "'quick' is not of the form KEY=VALUE");
  EXPECT_EQ(parse("PRINT_START BED 60").kind, CommandKind::malformed);
}

TEST(Parse, ReadsNumberedExtendedCommands) {
  const std::string line = with_checksum("N5 SET_PIN PIN=a*b VALUE=1");
  const Command command = parse(line);
  EXPECT_EQ(command.kind, CommandKind::extended) << command.problem;
  EXPECT_EQ(command.parameter("PIN"), "a*b");
  EXPECT_EQ(command.parameter("VALUE"), "1");
  EXPECT_EQ(parse("N5 PRINT_END*1").kind, CommandKind::malformed);
  EXPECT_EQ(parse("SET_PIN PIN=a*5").parameter("PIN"), "a*5");
}

TEST(Parse, UsesStorageAgainWithoutLeavingTraces) {
  Command command;
  parse("N1 PRINT_START BED=60 ; a", command);
  parse("G1 X1", command);
  EXPECT_TRUE(command.is('G', 1));
  EXPECT_EQ(command.name, "");
  EXPECT_EQ(command.line_number, std::nullopt);
  EXPECT_EQ(command.comment, "");
  EXPECT_EQ(command.arguments, "X1");
  ASSERT_EQ(command.words.size(), 1U);
  parse("", command);
  EXPECT_EQ(command.kind, CommandKind::none);
  EXPECT_TRUE(command.words.empty());
}

TEST(Parse, SurvivesAnyBytes) {
  std::mt19937_64 random(3);
  const std::string_view likely = "GMTNXYZEFS0123456789.+-*;()\"'\\=_# \t\r{}";
  std::uniform_int_distribution<std::size_t> pick(0, likely.size() - 1);
  std::uniform_int_distribution<int> byte(0, 255);
  std::uniform_int_distribution<int> length(0, 24);
  for (int i = 0; i < 300'000; ++i) {
    std::string line;
    for (int n = length(random); n > 0; --n) {
      line += byte(random) < 8 ? static_cast<char>(byte(random)) : likely[pick(random)];
    }
    const Command command = parse(line);
    ASSERT_EQ(command.kind == CommandKind::malformed, !command.problem.empty()) << line;
    ASSERT_EQ(command.kind == CommandKind::extended && command.name.empty(), false) << line;
    ASSERT_LE(command.words.size(), line.size()) << line;
    if (!command.comment.empty()) {
      ASSERT_EQ(command.comment.data() + command.comment.size(), line.data() + line.size()) << line;
    }
  }
}

}  // namespace
}  // namespace unflex::gcode
