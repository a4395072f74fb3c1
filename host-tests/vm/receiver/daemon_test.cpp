#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "box_process.hpp"
#include "receiver_gadget.hpp"

// The whole daemon, without privileges, with a probe receiver that another process plays; asked by the command.
namespace probebox::vm {
namespace {

using Json = nlohmann::json;
using testing::HasSubstr;

void replace(const std::filesystem::path& file, const std::string& from, const std::string& to) {
  std::ostringstream text;
  text << std::ifstream{file}.rdbuf();
  std::string content = text.str();
  const auto at = content.find(from);
  ASSERT_NE(at, std::string::npos) << file << " has no " << from;
  std::ofstream{file} << content.replace(at, from.size(), to);
}

// Nothing here reads what ball screws stretch by.
void removeScrews(const std::filesystem::path& file) {
  std::ifstream lines{file};
  std::string kept;
  bool of_screw = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("[")) of_screw = line.starts_with("[screw.");
    if (!of_screw) kept += line + "\n";
  }
  std::ofstream{file} << kept;
}

class DaemonWithAReceiver : public testing::Test {
 protected:
  void SetUp() override {
    const auto board = box.board();
    std::filesystem::remove(board / "world.toml");
    replace(board / "box.toml", "encoders = \"sim\"", "encoders = \"none\"");
    replace(board / "box.toml", "probe = \"sim\"", "probe = \"usb:RX-VM\"");
    replace(board / "box.toml", "drift = \"sim\"", "drift = \"none\"");
    removeScrews(board / "machine.toml");
    replace(board / "machine.toml", "sources = [\"screw\"]", "sources = []");
    replace(board / "probe.toml", "rate_hz = 2000", "rate_hz = 1973");
    box.start();
  }

  void play(std::vector<std::string> more = {}) {
    for (const char* const word : {"--rate", "1973", "--samples", "7"}) more.emplace_back(word);
    player = std::make_unique<ReceiverPlayer>(more);
    ReceiverGadget::grant();
  }

  // Asks until `done`; the last answer. Seldom: the guest has one processor, and asking makes the receiver's packets
  // late.
  Json statusWhen(const std::function<bool(const Json&)>& done) {
    Json status;
    for (int tries = 0; tries < 120; ++tries) {
      const auto answer = probebox({"status", "--json"});
      status = answer.status == 0 ? Json::parse(answer.output) : Json{};
      if (!status.is_null() && done(status)) return status;
      std::this_thread::sleep_for(std::chrono::seconds{1});
    }
    ADD_FAILURE() << "it never came to be; the last status is\n" << status.dump(1) << "\n" << box.log();
    return status;
  }
  Json whenLocked(std::uint64_t relocks) {
    return statusWhen([=](const Json& status) {
      const auto& receiver = status["receiver"];
      return !receiver.is_null() && receiver["state"] == "locked" && receiver["relocks"] == relocks;
    });
  }
  static std::string problemOf(const Json& status) {
    for (const auto& source : status["sources"]) {
      const std::string name = source["name"];
      if (name.find("probe receiver") != std::string::npos) return source["problem"];
    }
    return "no such source";
  }

  // All that the player delivered has arrived, and nothing else.
  void expectExactCounts(std::uint64_t by_players_before) {
    player->tell("mute");
    ReceiverPlayer::Counts counts;
    const auto status = statusWhen([&](const Json& answer) {
      counts = player->counts();
      return answer["receiver"]["arrived_samples"] == by_players_before + counts.delivered &&
             counts.taken == counts.delivered + counts.withheld + counts.refused + counts.returned;
    });
    EXPECT_EQ(status["receiver"]["arrived_samples"], by_players_before + counts.delivered);
    EXPECT_EQ(status["receiver"]["bad_packets"], 0);
    player->tell("speak");
  }

  ReceiverGadget gadget;
  BoxProcess box{BOARD_SIM};
  std::unique_ptr<ReceiverPlayer> player;
};

TEST_F(DaemonWithAReceiver, MapsItsCounterAndCountsExactlyWhatItSent) {
  auto status = statusWhen([](const Json&) { return true; });
  EXPECT_THAT(problemOf(status), HasSubstr("no probe receiver RX-VM is on USB"));
  EXPECT_TRUE(status["receiver"].is_null());

  play({"--ppm", "75"});
  status = whenLocked(0);
  EXPECT_EQ(problemOf(status), "");
  status = statusWhen([](const Json& answer) { return answer["receiver"]["sigma_ns"] < 2000; });
  EXPECT_NEAR(status["receiver"]["frequency_ppb"].get<double>(), -75e3, 2e3);

  const std::uint64_t missing = status["receiver"]["missing_samples"];
  player->tell("drop 10");
  status = statusWhen([&](const Json& answer) { return answer["receiver"]["missing_samples"] > missing; });
  EXPECT_EQ(status["receiver"]["missing_samples"], missing + 70);
  expectExactCounts(0);
  EXPECT_TRUE(box.running());
}

TEST_F(DaemonWithAReceiver, GoesOnWhenItIsUnpluggedAndWhenItsPlayerIsKilled) {
  play();
  whenLocked(0);
  gadget.unbind();
  auto status = statusWhen([](const Json& answer) { return !problemOf(answer).empty(); });
  EXPECT_EQ(status["receiver"]["state"], "unlocked");
  gadget.bind();
  ReceiverGadget::grant();
  status = whenLocked(1);
  EXPECT_EQ(problemOf(status), "");
  EXPECT_EQ(status["receiver"]["restarts"], 0);
  expectExactCounts(0);

  player->kill();
  status = statusWhen([](const Json& answer) { return !problemOf(answer).empty(); });
  const std::uint64_t before = status["receiver"]["arrived_samples"];
  play({"--first", "1000000"});
  whenLocked(2);
  expectExactCounts(before);
  EXPECT_TRUE(box.running());
}

}  // namespace
}  // namespace probebox::vm
