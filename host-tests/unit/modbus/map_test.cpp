#include "protocol/modbus/map.hpp"

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>
#include <regex>
#include <sstream>
#include <vector>

#include "firmware/procedure/methods/methods.hpp"
#include "protocol/modbus/page.hpp"
#include "protocol/modbus/refusals.hpp"
#include "protocol/modbus/result_blocks.hpp"

namespace probebox::modbus {
namespace {

using Image = std::array<std::uint16_t, kRegisterCount>;

// The first block is fixed for ever; this table is written from the specification, not from the map.
struct Fixed {
  std::uint16_t address;
  Kind kind;
  double scale;
  std::string_view unit;
};
constexpr std::array<Fixed, 19> kFirstBlock{{{0, Kind::u16, 1, ""},
                                             {1, Kind::u16, 1, ""},
                                             {2, Kind::u16, 1, ""},
                                             {3, Kind::u16, 1, ""},
                                             {4, Kind::u16, 1, ""},
                                             {5, Kind::i16, 0.1, "um"},
                                             {6, Kind::i16, 0.1, "um"},
                                             {7, Kind::i16, 0.1, "um"},
                                             {8, Kind::offset_i16, 0.1, "um"},
                                             {9, Kind::offset_i16, 0.1, "um"},
                                             {10, Kind::offset_i16, 0.1, "um"},
                                             {11, Kind::u16, 0.1, "s"},
                                             {12, Kind::u16, 1, ""},
                                             {16, Kind::f32, 1, "mm"},
                                             {18, Kind::f32, 1, "mm"},
                                             {20, Kind::f32, 1, "mm"},
                                             {32, Kind::i32, 1, "nm"},
                                             {34, Kind::i32, 1, "nm"},
                                             {36, Kind::i32, 1, "nm"}}};

TEST(RegisterMap, KeepsItsFirstBlockForEver) {
  ASSERT_GE(registers().size(), kFirstBlock.size());
  for (std::size_t i = 0; i < kFirstBlock.size(); ++i) {
    const auto& entry = registers()[i];
    EXPECT_EQ(entry.address, kFirstBlock[i].address);
    EXPECT_EQ(entry.kind, kFirstBlock[i].kind) << entry.address;
    EXPECT_EQ(entry.scale, kFirstBlock[i].scale) << entry.address;
    EXPECT_EQ(entry.unit, kFirstBlock[i].unit) << entry.address;
    EXPECT_EQ(entry.access, Access::read) << entry.address;
  }
}

// Whatever is added to the map is in the image: by its own line, or as a value of a result.
TEST(RegisterMap, NamesTheValueOfEachRegisterThatIsRead) {
  const auto isOfAResult = [](const Register& entry) {
    const auto covers = [&](const auto& block) {
      const auto at = addressesOf(block);
      return entry.address >= at.values && entry.address < at.end;
    };
    return std::ranges::any_of(resultBlocks(), covers) || std::ranges::any_of(toolTables(), covers);
  };
  for (const auto& entry : registers()) {
    const bool is_shown = entry.access == Access::read && !isOfAResult(entry);
    EXPECT_EQ(entry.value != nullptr, is_shown) << entry.address << " " << entry.name;
  }
}

TEST(RegisterMap, FindsAnEntryByEachOfItsAddressesAndNothingBetween) {
  for (unsigned address = 0; address < kRegisterCount + 50; ++address) {
    const Register* expected = nullptr;
    bool begins = false;
    for (const auto& entry : registers()) {
      for (unsigned row = 0; row < entry.rows; ++row) {
        const unsigned first = entry.address + row * entry.row_registers;
        if (address < first || address >= first + registersOf(entry.kind)) continue;
        EXPECT_EQ(expected, nullptr) << "two entries at " << address;
        expected = &entry;
        begins = address == first;
      }
    }
    EXPECT_EQ(covering(static_cast<std::uint16_t>(address)), expected) << address;
    EXPECT_EQ(find(static_cast<std::uint16_t>(address)), begins ? expected : nullptr) << address;
  }
}

TEST(RegisterMap, KeepsWhatWasReleasedWhereItIs) {
  // Written from the page, not from the map.
  EXPECT_EQ(find(64)->name, "X system delay");
  EXPECT_EQ(find(128)->name, "word order");
  EXPECT_EQ(find(157)->name, "marker: commit");
  EXPECT_EQ(find(178)->name, "centreline result");
  EXPECT_EQ(find(231)->name, "trigger: sequence");
  EXPECT_EQ(find(358)->name, "deviation CC, sd");
  for (const auto& entry : registers()) EXPECT_LE(entry.end(), kRegisterCount) << entry.name;
}

TEST(RegisterMap, HasARowOfSixteenRegistersForEachToolInEveryTable) {
  for (const unsigned first : {1000U, 3000U, 5000U, 7000U}) {
    for (unsigned tool : {1U, 2U, 57U, 99U}) {
      const auto row = static_cast<std::uint16_t>(first + 16 * (tool - 1));
      ASSERT_NE(find(row), nullptr) << row;
      EXPECT_EQ(find(row)->kind, Kind::f32);
      EXPECT_EQ(find(static_cast<std::uint16_t>(row + 15))->kind, Kind::u16) << "its state";
    }
    EXPECT_EQ(find(static_cast<std::uint16_t>(first + 16 * 99)), nullptr);
  }
}

TEST(RegisterMap, GivesEachRegisterAPinOfItsOwn) {
  const auto text = mapAsJson({});
  std::vector<std::string> pins;
  for (std::size_t at = 0; (at = text.find("\"hal_pin\": \"", at)) != std::string::npos; ++at)
    pins.push_back(text.substr(at, text.find('"', at + 12) - at));
  EXPECT_EQ(pins.size(), registers().size());
  std::ranges::sort(pins);
  EXPECT_EQ(std::ranges::adjacent_find(pins), pins.end());
}

// The names are the solvers' own, and none of them is without a number or missing from the page.
TEST(RefusalCodes, HaveANumberAndALineForEveryNameThatASolverGives) {
  // However the formatter breaks the line, and where the type of the answer stands for that of the refusal.
  std::ifstream page{PROBEBOX_SOURCE_DIR "/docs/metrology.md"};
  const std::string listed{std::istreambuf_iterator<char>{page}, {}};
  const std::regex named{"(?:(?:Refusal|Objection)\\{\\s*\"([a-z0-9-]+)\"|return \\{\\s*\"([a-z0-9]+-[a-z0-9-]+)\")"};
  std::size_t names = 0;
  for (const auto* room : {"/firmware/metrology", "/firmware/procedure"}) {
    for (const auto& file : std::filesystem::recursive_directory_iterator{PROBEBOX_SOURCE_DIR + std::string{room}}) {
      if (file.path().extension() != ".cpp") continue;
      std::ifstream source{file.path()};
      const std::string text{std::istreambuf_iterator<char>{source}, {}};
      for (std::sregex_iterator each{text.begin(), text.end(), named}, end; each != end; ++each, ++names) {
        const auto name = (*each)[1].str() + (*each)[2].str();
        EXPECT_NE(codeOfRefusal(name), refusal::not_in_list) << name << ": append it to protocol/modbus/refusals.cpp";
        EXPECT_NE(listed.find("`" + name), std::string::npos)
            << name << ": list it in docs/metrology.md, Refusals by name";
      }
    }
  }
  EXPECT_GT(names, 100U);
  EXPECT_EQ(codeOfRefusal("arc-too-short"), 101) << "numbers never change";
  EXPECT_EQ(codeOfRefusal("constant-distance"), 122) << "what does not change is a part of the name";
  EXPECT_EQ(codeOfRefusal("constant-radius"), 122);
  EXPECT_EQ(codeOfRefusal("constant-sensor"), 234) << "a name of its own comes before a part of a name";
  EXPECT_EQ(codeOfRefusal(""), refusal::none);
}

// Literals of a refusal's sentence: from behind its name to the brace that ends it.
std::string literalsFrom(std::string_view source) {
  std::string literals;
  int depth = 1;
  for (std::size_t at = 0; at < source.size() && depth > 0; ++at) {
    if (source[at] == '{') ++depth;
    if (source[at] == '}') --depth;
    if (source[at] != '"') continue;
    for (++at; at < source.size() && source[at] != '"'; ++at) {
      if (source[at] == '\\') ++at;
      literals += source[at];
    }
  }
  return literals;
}

// The cause comes first, behind the place; what to do follows behind a colon or a semicolon, or is what must be or is
// needed.
TEST(RefusalCodes, StandBesideACauseAndARemedy) {
  const std::regex begun{R"re((?:Refusal|Objection)\{\s*"([a-z0-9-]+)")re"};
  const std::regex place{R"re(^(in|of|row|table|column|config key|'\w*'|[, ])*: )re"};  // "table 'x', row 3: "
  const std::regex remedy{"[:;]| must | needs "};
  std::size_t sentences = 0;
  for (const auto* room : {"/firmware/metrology", "/firmware/procedure"}) {
    for (const auto& file : std::filesystem::recursive_directory_iterator{PROBEBOX_SOURCE_DIR + std::string{room}}) {
      if (file.path().extension() != ".cpp") continue;
      std::ifstream source{file.path()};
      const std::string text{std::istreambuf_iterator<char>{source}, {}};
      for (std::sregex_iterator each{text.begin(), text.end(), begun}, end; each != end; ++each) {
        const auto said = literalsFrom(std::string_view{text}.substr(static_cast<std::size_t>(each->position()) +
                                                                     static_cast<std::size_t>(each->length())));
        if (said.starts_with("is ")) continue;  // of one value: what it is of, and the remedy, are put around it
        ++sentences;
        EXPECT_TRUE(std::regex_search(std::regex_replace(said, place, ""), remedy))
            << file.path() << ": " << (*each)[1] << ": " << said;
      }
    }
  }
  EXPECT_GT(sentences, 100U);
}

TEST(RegisterMap, PutsTheHighWordFirstUnlessToldOtherwise) {
  Image image{};
  encode(*find(32), 0x12345678, WordOrder::high_first, image);
  EXPECT_EQ(image[32], 0x1234);
  EXPECT_EQ(image[33], 0x5678);
  encode(*find(32), -2, WordOrder::low_first, image);
  EXPECT_EQ(image[32], 0xFFFE);
  EXPECT_EQ(image[33], 0xFFFF);
  encode(*find(16), 1.0, WordOrder::high_first, image);
  EXPECT_EQ(image[16], 0x3F80);
  EXPECT_EQ(image[17], 0);
}

TEST(RegisterMap, SaturatesAtTheEndsOfEveryKind) {
  Image image{};
  for (const double huge : {1e30, HUGE_VAL}) {
    encode(*find(5), huge, WordOrder::high_first, image);
    encode(*find(6), -huge, WordOrder::high_first, image);
    encode(*find(8), huge, WordOrder::high_first, image);
    encode(*find(9), -huge, WordOrder::high_first, image);
    encode(*find(11), huge, WordOrder::high_first, image);
    encode(*find(32), -huge, WordOrder::high_first, image);
    encode(*find(116), huge, WordOrder::high_first, image);
    EXPECT_EQ(image[5], 32767);
    EXPECT_EQ(image[6], 65536 - 32767) << "the same limit on both sides";
    EXPECT_EQ(image[8], 65535);
    EXPECT_EQ(image[9], 1);
    EXPECT_EQ(image[11], 65535);
    EXPECT_EQ(image[32], 0x8000);
    EXPECT_EQ(image[116], 0xFFFF);
  }
}

TEST(RegisterMap, ShowsNoInfinityAndNoNaN) {
  Image image{};
  for (const double huge : {1e39, HUGE_VAL, -1e39, -HUGE_VAL, std::nan("")}) {
    encode(*find(16), huge, WordOrder::high_first, image);
    const auto shown = decode(*find(16), WordOrder::high_first, image);
    EXPECT_TRUE(std::isfinite(shown)) << huge;
    EXPECT_EQ(shown > 0, huge > 0);
    EXPECT_EQ(shown < 0, huge < 0);
  }
}

RC_GTEST_PROP(RegisterMap, GivesBackWhatWasEncodedToOneCount, (std::int32_t value, bool low_first)) {
  const auto order = low_first ? WordOrder::low_first : WordOrder::high_first;
  for (const auto& entry : registers()) {
    Image image{};
    const double range = entry.kind == Kind::i16 || entry.kind == Kind::offset_i16 ? 32767.0 : 65535.0;
    double counts = registersOf(entry.kind) == 2 ? value : std::fmod(value, range);
    if (entry.kind == Kind::u16 || entry.kind == Kind::u32) counts = std::abs(counts);
    encode(entry, counts * entry.scale, order, image);
    const double slack = entry.kind == Kind::f32 ? std::abs(counts) * 6e-8 : 1e-6;
    RC_ASSERT(std::abs(decode(entry, order, image) / entry.scale - counts) <= slack);
  }
}

TEST(ModbusPage, IsWhatTheMapSays) {
  std::vector<MethodNumber> methods;
  for (const auto* method : procedure::liveMethods()) methods.push_back({method->number, method->name()});
  const std::string path = PROBEBOX_SOURCE_DIR "/protocol/MODBUS.md";
  if (std::getenv("PROBEBOX_WRITE_PAGES") != nullptr) std::ofstream{path} << referencePage(methods);
  std::ifstream file{path};
  std::ostringstream page;
  page << file.rdbuf();
  EXPECT_EQ(page.str(), referencePage(methods)) << "stale: run cmake --build build --target modbus-page";
}

TEST(ModbusPage, ForProgramsIsWhatTheMapSays) {
  std::vector<MethodNumber> methods;
  for (const auto* method : procedure::liveMethods()) methods.push_back({method->number, method->name()});
  const std::string path = PROBEBOX_SOURCE_DIR "/protocol/map.json";
  if (std::getenv("PROBEBOX_WRITE_PAGES") != nullptr) std::ofstream{path} << mapAsJson(methods);
  std::ifstream file{path};
  std::ostringstream text;
  text << file.rdbuf();
  EXPECT_EQ(text.str(), mapAsJson(methods)) << "stale: run cmake --build build --target modbus-page";
}

}  // namespace
}  // namespace probebox::modbus
