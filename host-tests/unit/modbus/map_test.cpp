#include "protocol/modbus/map.hpp"

#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>
#include <sstream>
#include <vector>

#include "firmware/procedure/methods/methods.hpp"
#include "protocol/modbus/page.hpp"

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

TEST(RegisterMap, FindsAnEntryByEachOfItsAddressesAndNothingBetween) {
  for (unsigned address = 0; address < kRegisterCount + 50; ++address) {
    const Register* expected = nullptr;
    for (const auto& entry : registers()) {
      if (address >= entry.address && address < entry.address + registersOf(entry.kind)) expected = &entry;
    }
    EXPECT_EQ(covering(static_cast<std::uint16_t>(address)), expected);
    EXPECT_EQ(find(static_cast<std::uint16_t>(address)),
              expected != nullptr && expected->address == address ? expected : nullptr);
  }
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

}  // namespace
}  // namespace probebox::modbus
