#include "protocol/receiver/front_end.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <string>
#include <thread>

#include "box_on_usb.hpp"
#include "fake_box.hpp"
#include "host-tests/mock_usb/front_end_on_bus.hpp"
#include "in_process.hpp"
#include "protocol/messages/status.hpp"
#include "runtime_directory.hpp"
#include "tools/probebox/commands/front_end_image.hpp"

// Another program for the front end: the file is checked, the chip restarts into its boot loader, whose drive here is a
// folder, and comes back.
namespace probebox::command {
namespace {

namespace fs = std::filesystem;

std::string words(std::initializer_list<std::uint32_t> values) {
  std::string bytes;
  for (const auto value : values)
    for (unsigned i = 0; i < 4; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xFFU);
  return bytes;
}

// Remainder of a division by the polynomial, a bit at a time from the top, as the data sheet defines the checksum.
std::uint32_t checksumOf(const std::string& bytes) {
  std::uint64_t remainder = 0xFFFFFFFF;
  for (const char byte : bytes) {
    for (int bit = 7; bit >= 0; --bit) {
      const bool divides = ((remainder >> 31U) & 1U) != (static_cast<unsigned char>(byte) >> bit & 1U);
      remainder = (remainder << 1U) & 0xFFFFFFFF;
      if (divides) remainder ^= 0x04C11DB7;
    }
  }
  return static_cast<std::uint32_t>(remainder);
}

// A program that does nothing, with boot2, vectors and mark at their places.
std::string flashWith(std::uint16_t version) {
  std::string flash(252, '\x5A');
  flash += words({checksumOf(flash)});
  flash.resize(front_end::kImageMarkAt, '\0');
  const front_end::ImageMark mark{.version = version};
  flash.append(mark.name.begin(), mark.name.end());
  flash += words({static_cast<std::uint32_t>(version | mark.packet_version << 16U)});
  flash.resize(1024, '\x11');
  return flash;
}

std::string uf2Of(const std::string& flash, std::uint32_t family = 0xE48BFF56) {
  std::string file;
  const auto blocks = static_cast<std::uint32_t>(flash.size() / 256);
  for (std::uint32_t i = 0; i < blocks; ++i) {
    file += words({0x0A324655, 0x9E5D5157, 0x2000, 0x10000000 + 256 * i, 256, i, blocks, family});
    file += flash.substr(256 * i, 256) + std::string(220, '\0') + words({0x0AB16F30});
  }
  return file;
}

std::string faultOf(const std::string& file) {
  const auto checked = checkFrontEndImage(file);
  return checked ? "none" : checked.error().name;
}

TEST(FrontEndImage, IsTakenWhole) {
  const auto good = uf2Of(flashWith(0x0203));
  const auto checked = checkFrontEndImage(good);
  ASSERT_TRUE(checked) << checked.error().what;
  EXPECT_EQ(checked->version, 0x0203);
  EXPECT_EQ(checked->flash_bytes, 1024U);
}

TEST(FrontEndImage, IsRefusedByNameWhereItWouldNotRun) {
  const auto good = uf2Of(flashWith(0x0203));
  EXPECT_EQ(faultOf(""), "not-uf2");
  EXPECT_EQ(faultOf("PK" + good), "not-uf2");
  EXPECT_EQ(faultOf(uf2Of(flashWith(1), 0xADA52840)), "another-chip");
  EXPECT_EQ(faultOf(good.substr(0, good.size() - 1)), "damaged-image");
  EXPECT_EQ(faultOf(good.substr(0, good.size() - 512)), "damaged-image") << "the last block is missing";
  EXPECT_EQ(faultOf(good.substr(0, 512) + good.substr(1024)), "damaged-image") << "one in the middle is";
  EXPECT_EQ(faultOf(good + good.substr(0, 512)), "damaged-image");
  auto boot2 = flashWith(1);
  boot2[17] = '\0';
  EXPECT_EQ(faultOf(uf2Of(boot2)), "bad-boot2");
  auto unmarked = flashWith(1);
  unmarked[front_end::kImageMarkAt] = 'P';
  EXPECT_EQ(faultOf(uf2Of(unmarked)), "not-a-front-end");
  EXPECT_EQ(faultOf(uf2Of(flashWith(1).substr(0, 256))), "not-a-front-end");
}

class FrontEndUpdate : public testing::Test {
 protected:
  void SetUp() override {
    if (!bus_) GTEST_SKIP() << "USB is not tested: install libumockdev-dev and configure again";
    fs::create_directories(drive_);
    bus_->plug(front_end_.device());
  }
  void TearDown() override {
    done_ = true;
    if (chip_.joinable()) chip_.join();
  }

  void showDrive() {
    std::ofstream{drive_ / "INFO_UF2.TXT"} << "UF2 Bootloader v3.0\nModel: Raspberry Pi RP2\nBoard-ID: RPI-RP2\n";
  }
  // False at the end of the test.
  bool waitForFile(std::size_t bytes) const {
    std::error_code none;
    while (!done_ && fs::file_size(drive_ / "front_end.uf2", none) != bytes)
      std::this_thread::sleep_for(std::chrono::milliseconds{5});
    return !done_;
  }
  // As the chip does it: its drive appears, and once the whole file is there it starts the program in it.
  void startChip(std::size_t file_bytes, std::uint16_t version) {
    chip_ = std::thread{[this, file_bytes, version] {
      while (!done_ && !front_end_.takeBootLoader()) std::this_thread::sleep_for(std::chrono::milliseconds{5});
      if (done_) return;
      bus_->unplug("1-3");
      showDrive();
      if (!waitForFile(file_bytes)) return;
      front_end_.pretendVersion(version);
      auto device = front_end_.device();
      ++device.address;
      bus_->plug(device);
    }};
  }
  std::string write(const std::string& bytes) {
    const auto path = directory_.file("front_end.uf2");
    std::ofstream{path, std::ios::binary} << bytes;
    return path;
  }
  Finished update(const std::string& path, const std::vector<std::string>& more = {}) {
    std::vector<std::string> all{"--json",  "update",        "--front-end", path,
                                 "--drive", drive_.string(), "--patience",  "2"};
    all.insert(all.end(), more.begin(), more.end());
    return probebox(all);
  }

  RuntimeDirectory directory_;
  fs::path drive_{directory_.file("drive")};
  usb::FrontEndOnBus front_end_;
  std::unique_ptr<usb::MockBus> bus_ = usb::makeMockBus();
  std::atomic<bool> done_{};
  std::thread chip_;
};

TEST_F(FrontEndUpdate, BringsItToTheVersionOfTheFile) {
  const auto file = uf2Of(flashWith(0x0203));
  startChip(file.size(), 0x0203);
  const auto done = update(write(file));
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_EQ(done.object()["version_before"], "1.0");
  EXPECT_EQ(done.object()["version"], "2.3");
  EXPECT_EQ(done.object()["serial_number"], usb::FrontEndOnBus::kSerial);
  std::ifstream copied{drive_ / "front_end.uf2", std::ios::binary};
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>{copied}, {}), file);
}

TEST_F(FrontEndUpdate, SaysThatItCameBackWithAnotherVersion) {
  const auto file = uf2Of(flashWith(0x0203));
  startChip(file.size(), 0x0100);
  const auto failed = update(write(file));
  EXPECT_EQ(failed.status, 1);
  EXPECT_EQ(failed.object()["error"], "version-differs");
}

TEST_F(FrontEndUpdate, LeavesItAloneWhereTheFileIsNotNewerOrNotItsOwn) {
  const auto same = uf2Of(flashWith(front_end::kVersion));
  EXPECT_EQ(update(write(same)).object()["error"], "not-newer");
  EXPECT_EQ(update(write(same.substr(512))).object()["error"], "damaged-image");
  EXPECT_EQ(update(write(uf2Of(flashWith(0x0203))), {"--receiver", "RX-9"}).object()["error"], "no-front-end");
  EXPECT_FALSE(front_end_.takeBootLoader());
  startChip(same.size(), front_end::kVersion);
  EXPECT_EQ(update(write(same), {"--force"}).status, 0);
}

TEST_F(FrontEndUpdate, NamesTheGroupOfThoseWhoMayOpenIt) {
  const auto file = write(uf2Of(flashWith(0x0203)));
  fs::permissions(directory_.path(), fs::perms{0755});
  bus_->setMode("1-3", 0600);
  Finished refused;
  {
    const AsNobody nobody;
    refused = update(file);
  }
  EXPECT_EQ(refused.object()["error"], "no-permission");
  EXPECT_THAT(refused.err, testing::HasSubstr("group probebox"));
}

TEST_F(FrontEndUpdate, LeavesAnotherReceiverAlone) {
  bus_->unplug("1-3");
  auto other = front_end_.device();
  other.control = {};
  bus_->plug(other);
  EXPECT_EQ(update(write(uf2Of(flashWith(0x0203)))).object()["error"], "another-receiver");
}

// A run or a cut would lose its samples.
TEST_F(FrontEndUpdate, LeavesOneAloneThatIsReadWhereNoBoxCanBeAsked) {
  bus_->claimElsewhere("1-3", "usbfs");
  EXPECT_EQ(update(write(uf2Of(flashWith(0x0203)))).object()["error"], "in-use");
  EXPECT_FALSE(front_end_.takeBootLoader());
}

TEST_F(FrontEndUpdate, AsksTheBoxThatReadsItAndNoOther) {
  bus_->claimElsewhere("1-3", "usbfs");
  const auto file = uf2Of(flashWith(0x0203));
  const auto box_reads = [](std::string_view serial) {
    return FakeBoxOptions{.answers_first = [serial](messages::Operation operation, auto) -> std::optional<FakeReply> {
      if (operation != messages::Operation::status) return std::nullopt;
      messages::Status::Answer status;
      status.front_end.serial_number = serial;
      return FakeReply{messages::ErrorCode::ok, {}, messages::encoded(status)};
    }};
  };
  const FakeBox of_another{box_reads("E0C9125B0D9B5A26")};
  EXPECT_EQ(update(write(file), {"-u", of_another.uri()}).object()["error"], "in-use") << "that box is at rest";
  EXPECT_FALSE(front_end_.takeBootLoader());
  const FakeBox of_this{box_reads(usb::FrontEndOnBus::kSerial)};
  startChip(file.size(), 0x0203);
  const auto done = update(write(file), {"-u", of_this.uri()});
  EXPECT_EQ(done.status, 0) << done.err;
}

TEST_F(FrontEndUpdate, KnowsTheChipOfTheDriveFromOneThatRuns) {
  const auto file = uf2Of(flashWith(0x0203));
  showDrive();
  usb::FrontEndOnBus waiting;
  waiting.pretendVersion(0x0203);
  chip_ = std::thread{[&] {
    if (!waitForFile(file.size())) return;
    auto device = waiting.device();
    device.path = "1-4";
    ++device.address;
    device.serial_number = "E0C9125B0D9B5A26";
    bus_->plug(device);
  }};
  const auto done = update(write(file));
  done_ = true;
  chip_.join();
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_EQ(done.object()["serial_number"], "E0C9125B0D9B5A26");
  EXPECT_FALSE(front_end_.takeBootLoader());
}

TEST_F(FrontEndUpdate, SaysWhereItLeavesTheChipWhenItIsInterrupted) {
  std::atomic<bool> interrupted{};
  chip_ = std::thread{[&] {
    while (!done_ && !front_end_.takeBootLoader()) std::this_thread::sleep_for(std::chrono::milliseconds{5});
    interrupted = true;
  }};
  const auto stopped = probebox({"update", "--front-end", write(uf2Of(flashWith(0x0203))), "--drive", drive_.string()},
                                {}, &interrupted);
  done_ = true;
  chip_.join();
  EXPECT_EQ(stopped.status, static_cast<int>(ExitStatus::interrupted));
  EXPECT_THAT(stopped.err, testing::HasSubstr("boot loader"));
}

TEST_F(FrontEndUpdate, CannotBeLeftToItself) {
  EXPECT_EQ(update(write(uf2Of(flashWith(0x0203))), {"--no-wait"}).status, static_cast<int>(ExitStatus::usage));
  EXPECT_FALSE(front_end_.takeBootLoader());
}

TEST_F(FrontEndUpdate, NamesADriveThatDoesNotAppear) {
  const auto failed = update(write(uf2Of(flashWith(0x0203))));
  EXPECT_EQ(failed.object()["error"], "no-drive");
  EXPECT_TRUE(front_end_.takeBootLoader());
}

}  // namespace
}  // namespace probebox::command
