#include "firmware/front_end/core/control.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <memory>
#include <random>
#include <rapidcheck.h>
#include <set>
#include <vector>

#include "protocol/messages/fields.hpp"

namespace probebox::front_end {
namespace {

struct Host {
  std::unique_ptr<Assembly> assembly = std::make_unique<Assembly>();
  Control control{*assembly, std::string_view{"0123456789ABCDEF"}};

  Host() { assembly->start({}, 0); }
  Answer ask(unsigned type, unsigned request, unsigned value = 0, unsigned index = 0, unsigned length = 0) {
    std::array<std::byte, 8> setup{};
    const std::array<unsigned, 8> bytes{type,         request,     value & 255U,  value >> 8U,
                                        index & 255U, index >> 8U, length & 255U, length >> 8U};
    std::ranges::transform(bytes, setup.begin(), [](unsigned byte) { return static_cast<std::byte>(byte); });
    return control.setup(setup);
  }
};

std::vector<std::byte> encoded(const Settings& settings) {
  return messages::encoded(settings);
}

TEST(FrontEndControl, CutsAnswersToTheLengthThatIsAsked) {
  Host host;
  EXPECT_EQ(host.ask(0x80, 6, 0x0100, 0, 8).bytes.size(), 8U);
  EXPECT_EQ(host.ask(0x80, 6, 0x0100, 0, 64).bytes.size(), 18U);
  EXPECT_EQ(host.ask(0x80, 6, 0x0303, 0x409, 255).bytes.size(), 34U);
}

// One part is a whole answer, so no answer is as long as a part of endpoint 0, which would ask for an empty one.
TEST(FrontEndControl, AnswersInOnePart) {
  EXPECT_TRUE(rc::check("whatever it is asked", [] {
    std::mt19937_64 random{*rc::gen::arbitrary<std::uint64_t>()};
    Host host;
    for (int i = 0; i < 300; ++i) {
      const auto below = [&](unsigned most) { return static_cast<unsigned>(random() % most); };
      const unsigned length = below(300);
      const auto answer = host.ask(below(256), below(16), below(65'536), below(4), length);
      RC_ASSERT(answer.bytes.size() <= length);
      RC_ASSERT(answer.bytes.size() < kControlBytes || answer.bytes.size() == length);
      RC_ASSERT(answer.expected <= kControlBytes);
      RC_ASSERT(host.control.address() < 128);
      std::vector<std::byte> data(random() % (kControlBytes + 1));
      for (auto& byte : data) byte = static_cast<std::byte>(random());
      if (answer.kind == Answer::Kind::out) host.control.data(data);
      if (const auto settings = host.control.takeSettings()) RC_ASSERT(whyRefused(*settings) == RefusalCode::none);
    }
  }));
}

TEST(FrontEndControl, TakesAHostAnewAndHaltsItsEndpoint) {
  Host host;
  EXPECT_EQ(host.ask(0x01, 11).kind, Answer::Kind::stall) << "not configured yet";
  EXPECT_EQ(host.ask(0x00, 9, 1).kind, Answer::Kind::acknowledge);
  EXPECT_TRUE(host.control.configured());
  EXPECT_TRUE(host.control.takeNewHost());
  EXPECT_FALSE(host.control.takeNewHost());
  EXPECT_EQ(host.ask(0x02, 3, 0, 0x81).kind, Answer::Kind::acknowledge);
  EXPECT_TRUE(host.control.halted());
  EXPECT_EQ(host.ask(0x82, 0, 0, 0x81, 2).bytes[0], std::byte{1});
  EXPECT_EQ(host.ask(0x02, 1, 0, 0x81).kind, Answer::Kind::acknowledge);
  EXPECT_FALSE(host.control.halted());
  EXPECT_TRUE(host.control.takeNewHost());
  host.control.reset();
  EXPECT_FALSE(host.control.configured());
}

TEST(FrontEndControl, ChecksSettingsBeforeTheyAreTaken) {
  Host host;
  const Settings wanted{
      .steps_a_sample = 5000, .samples_a_packet = 3, .sync_out_steps = 0, .full_scale_nm = {7, 8, -9}};
  EXPECT_EQ(encoded(wanted).size(), kSettingsBytes);
  EXPECT_EQ(host.ask(0x40, 4, 0, 0, kSettingsBytes).expected, kSettingsBytes);
  EXPECT_EQ(host.control.data(encoded(wanted)).kind, Answer::Kind::acknowledge);
  EXPECT_EQ(host.control.takeSettings(), wanted);
  EXPECT_EQ(host.control.data(encoded({.samples_a_packet = 99})).kind, Answer::Kind::stall);
  EXPECT_FALSE(host.control.takeSettings());
  EXPECT_EQ(host.assembly->counters().last_refusal, static_cast<std::uint8_t>(RefusalCode::bad_samples_a_packet));
}

TEST(FrontEndControl, RestartsIntoTheBootLoaderByItsKeyAlone) {
  Host host;
  EXPECT_EQ(host.ask(0x40, 5, 1).kind, Answer::Kind::stall);
  EXPECT_FALSE(host.control.takeBootLoader());
  EXPECT_EQ(host.ask(0x40, 5, kBootLoaderKey).kind, Answer::Kind::acknowledge);
  EXPECT_TRUE(host.control.takeBootLoader());
}

TEST(FrontEndPins, AreEachUsedOnce) {
  std::set<unsigned> gpios;
  std::set<std::string_view> names;
  for (const auto& pin : kPins) {
    EXPECT_LT(pin.gpio, 30);
    EXPECT_TRUE(gpios.insert(pin.gpio).second) << pin.name;
    EXPECT_TRUE(names.insert(pin.name).second) << pin.name;
  }
  Host host;
  EXPECT_EQ(host.ask(0xc0, 2, 0, 0, 64).bytes.size(), kPins.size());
}

}  // namespace
}  // namespace probebox::front_end
