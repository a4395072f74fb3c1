#pragma once
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <memory>
#include <string>
#include <unistd.h>
#include <utility>
#include <vector>

#include "drivers/tcp/linux_tcp.hpp"
#include "host-tests/host/test_host.hpp"
#include "host-tests/keys/shop.hpp"
#include "tools/tour/process.hpp"

namespace probebox {

// A daemon of the emulated machine with a tls: link, and the command of persons who come through it; the real programs.
class Door : public testing::Test {
 protected:
  Door() {
    std::filesystem::create_directories(folder / "config");
    setenv("PROBEBOX_RENDEZVOUS", folder.c_str(), 1);
    plain = freeAddress();
    door = freeAddress();
  }
  ~Door() override {
    daemon.reset();
    unsetenv("PROBEBOX_TLS");
    std::filesystem::remove_all(folder);
  }

  static tcp::Address freeAddress() { return tcp::Listener::open({.host = "127.0.0.1", .port = 0})->address(); }
  std::string uri() const { return "tls:localhost:" + std::to_string(door.port); }
  std::string plainUri() const { return "tcp:" + tcp::describe(plain); }

  // more: of service.toml, such as persons.
  void start(const std::string& more, const tls::KeyFiles& keys) {
    startWith("[tls]\ncertificate = \"" + keys.certificate + "\"\nkey = \"" + keys.key + "\"\npeople_ca = \"" +
              keys.trusted + "\"\n" + more);
  }
  // access: further rights of the plain link.
  void startWith(const std::string& tls, const std::string& access = {}) {
    std::ofstream{folder / "config/service.toml"}
        << "links = [\"" << plainUri() << "\", \"tls:" << tcp::describe(door) << "\"]\n"
        << "[access]\nallow_marker = true\nallow_homing = true\nallow_inhibit = true\n"
        << access << tls;
    auto started = tour::Process::start({PROBEBOXD, "--board", "sim", "--config", (folder / "config").string(),
                                         "--state", (folder / "state").string(), "--time-scale", "6"},
                                        (folder / "log").string());
    ASSERT_TRUE(started) << started.error().what;
    daemon = std::make_unique<tour::Process>(std::move(*started));
    const auto host = support::TestHost::connect(plainUri());
    ASSERT_TRUE(host && host->waitForLock());
  }
  void start(const std::string& more) { start(more, shop.box()); }

  // From now on the command is this person's.
  void become(const tls::KeyFiles& files) const {
    const auto own = folder / "own";
    std::filesystem::remove_all(own);
    std::filesystem::create_directories(own);
    std::filesystem::copy_file(files.certificate, own / "me.crt");
    std::filesystem::copy_file(files.key, own / "me.key");
    std::filesystem::copy_file(files.trusted, own / "boxes.crt");
    setenv("PROBEBOX_TLS", own.c_str(), 1);
  }
  Outcome<std::string> probebox(std::vector<std::string> words) const {
    std::vector<std::string> command{PROBEBOX, "--json", "-u", uri()};
    command.insert(command.end(), words.begin(), words.end());
    return tour::outputOf(command);
  }
  // Empty where it is no refusal.
  std::string refusal(std::vector<std::string> words) const {
    const auto said = probebox(std::move(words));
    return said ? std::string{} : said.error().what;
  }

  const std::filesystem::path folder = std::filesystem::path{testing::TempDir()} / ("door-" + std::to_string(getpid()));
  support::Shop shop{folder / "shop"};
  tcp::Address plain, door;
  std::unique_ptr<tour::Process> daemon;
};

}  // namespace probebox
