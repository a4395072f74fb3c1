#pragma once
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <fcntl.h>
#include <filesystem>
#include <functional>
#include <gtest/gtest.h>
#include <memory>
#include <mutex>
#include <optional>
#include <sstream>
#include <string>
#include <sys/wait.h>
#include <termios.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include "drivers/io/descriptor.hpp"
#include "drivers/serial/emulator.hpp"
#include "firmware/app/cnc/modbus_server.hpp"

namespace probebox::app {

// What a register server shows and takes, beside a real Modbus master (mbpoll).
class ServedRegisters : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::system("command -v mbpoll >/dev/null 2>&1") != 0) GTEST_SKIP() << "mbpoll is not installed";
  }

  // One request, and what mbpoll prints about it: "[5]:  -123".
  static std::string ask(const std::string& options, const std::string& at, const std::string& values) {
    const auto command =
        "timeout 60 mbpoll -0 -1 " + options + " " + at + (values.empty() ? "" : " -- " + values) + " 2>&1";
    std::unique_ptr<FILE, int (*)(FILE*)> pipe{popen(command.c_str(), "r"), pclose};
    std::string output;
    std::array<char, 4096> buffer{};
    while (const auto count = fread(buffer.data(), 1, buffer.size(), pipe.get())) output.append(buffer.data(), count);
    return output;
  }

  void show(const published::Snapshot& snapshot) {
    const std::lock_guard lock{mutex_};
    snapshot_ = snapshot;
  }
  std::vector<Marker> markers() {
    const std::lock_guard lock{mutex_};
    return markers_;
  }

  // Waits for what must come, with a generous end.
  static bool eventually(const std::function<bool()>& condition) {
    for (int i = 0; i < 3000; ++i) {
      if (condition()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds{10});
    }
    return false;
  }

  RegisterServer::Callbacks callbacks() {
    return {.registers = {.snapshot =
                              [this] {
                                const std::lock_guard lock{mutex_};
                                return snapshot_;
                              },
                          .take = [this](std::span<const Event> said) { return take(said); },
                          .kept =
                              [this] {
                                return RegisterHandler::Kept{word_order_, inhibits_};
                              },
                          .keep =
                              [this](modbus::WordOrder order) {
                                std::this_thread::sleep_for(disk_time_.load());
                                if (disk_takes_) word_order_ = order;
                                return disk_takes_.load();
                              }},
            .report = [this](const std::string& text) {
              const std::lock_guard lock{mutex_};
              reports_ += text + "\n";
            }};
  }
  std::string reports() {
    const std::lock_guard lock{mutex_};
    return reports_;
  }

  std::atomic<bool> markers_allowed_{true};
  std::atomic<bool> disk_takes_{true};
  std::atomic<std::chrono::milliseconds> disk_time_{};
  std::atomic<bool> inhibits_{false};

 private:
  bool take(std::span<const Event> said) {
    const std::lock_guard lock{mutex_};
    for (const auto& event : said) {
      const auto* marker = std::get_if<Marker>(&event);
      if (markers_allowed_ && marker != nullptr) markers_.push_back(*marker);
    }
    return markers_allowed_.load();
  }

  std::atomic<modbus::WordOrder> word_order_{};
  std::mutex mutex_;
  published::Snapshot snapshot_;
  std::vector<Marker> markers_;
  std::string reports_;
};

// The server at one end of an emulated cable, the master at the other.
class ModbusOnCable : public ServedRegisters {
 protected:
  void SetUp() override {
    ServedRegisters::SetUp();
    if (IsSkipped()) return;
    folder_ = std::filesystem::temp_directory_path() / ("probebox-modbus-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
    auto cable = serial::EmulatedCable::open(folder_ / "box", folder_ / "cnc");
    ASSERT_TRUE(cable.ok()) << cable.error().what;
    cable_.emplace(std::move(cable).value());
    options_.line = {(folder_ / "box").string(), {19200, serial::Parity::even, 8, 1}};
    startServer();
    cable_thread_ = std::jthread{[this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        const std::lock_guard lock{cable_mutex_};
        cable_->pump(std::chrono::milliseconds{2});
      }
    }};
  }

  void startServer() {
    if (server_) server_->stop();
    server_thread_ = {};
    server_ = std::make_unique<ModbusServer>(options_, callbacks());
    const auto opened = server_->open();
    ASSERT_TRUE(opened.ok()) << opened.error().what;
    server_thread_ = std::jthread{[this] { server_->run(); }};
  }

  void TearDown() override {
    if (server_) server_->stop();
    server_thread_ = {};
    cable_thread_ = {};
    cable_.reset();
    std::filesystem::remove_all(folder_);
  }

  // Without parity: a pseudo terminal has none, and mbpoll takes it for an error when nothing of its settings is new to
  // the line.
  std::string poll(const std::string& options, const std::string& values = "") {
    return ask("-m rtu -a 1 -b 19200 -P none -o 2 " + options, cncPort(), values);
  }

  // As a real master does before each request.
  void clearLine() const {
    const io::Descriptor port{open(cncPort().c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)};
    EXPECT_EQ(tcflush(port.get(), TCIFLUSH), 0);
  }

  void onCable(const std::function<void(serial::EmulatedCable&)>& act) {
    const std::lock_guard lock{cable_mutex_};
    act(*cable_);
  }
  std::string cncPort() const { return (folder_ / "cnc").string(); }

  std::unique_ptr<ModbusServer> server_;

 private:
  std::filesystem::path folder_;
  ModbusOptions options_;
  std::optional<serial::EmulatedCable> cable_;
  std::mutex cable_mutex_;
  std::jthread server_thread_;
  std::jthread cable_thread_;
};

}  // namespace probebox::app
