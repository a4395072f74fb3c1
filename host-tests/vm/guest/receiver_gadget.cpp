#include "receiver_gadget.hpp"

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <fcntl.h>
#include <filesystem>
#include <signal.h>
#include <spawn.h>
#include <sstream>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <utility>

#include "box_user.hpp"
#include "fail.hpp"
#include "kernel_files.hpp"

namespace probebox::vm {
namespace {

namespace fs = std::filesystem;

const std::string kGadget = ReceiverGadget::kFolder;

}  // namespace

ReceiverGadget::ReceiverGadget() {
  fs::create_directory(kGadget);
  writeTo(kGadget + "/idVendor", "0x1209");
  writeTo(kGadget + "/idProduct", "0x0001");
  writeTo(kGadget + "/bcdUSB", "0x0200");
  fs::create_directory(kGadget + "/strings/0x409");
  writeTo(kGadget + "/strings/0x409/manufacturer", "probebox");
  writeTo(kGadget + "/strings/0x409/product", "played receiver");
  writeTo(kGadget + "/strings/0x409/serialnumber", kSerialNumber);
  fs::create_directory(kGadget + "/configs/c.1");
  fs::create_directory(kGadget + "/functions/ffs.receiver");
  fs::create_directory_symlink(kGadget + "/functions/ffs.receiver", kGadget + "/configs/c.1/ffs.receiver");
  fs::create_directories(kMount);
  if (mount("receiver", kMount, "functionfs", 0, nullptr) != 0) fail(kMount);
}

// configfs: one by one, from the inside.
ReceiverGadget::~ReceiverGadget() {
  std::error_code ignored;  // the guest ends anyway
  if (!readFrom(kGadget + "/UDC").empty()) unbind();
  umount(kMount);
  fs::remove(kGadget + "/configs/c.1/ffs.receiver", ignored);
  for (const char* const part : {"/configs/c.1", "/functions/ffs.receiver", "/strings/0x409", ""}) {
    rmdir((kGadget + part).c_str());
  }
}

void ReceiverGadget::unbind() {
  writeTo(kGadget + "/UDC", "\n");
}

void ReceiverGadget::bind() {
  writeTo(kGadget + "/UDC", kController);
}

std::string ReceiverGadget::node() {
  std::error_code error;
  for (const auto& device : fs::directory_iterator{"/sys/bus/usb/devices", error}) {
    const std::string folder = device.path();
    if (!fs::exists(folder + "/serial") || readFrom(folder + "/serial") != kSerialNumber) continue;
    char text[32];
    std::snprintf(text, sizeof text, "/dev/bus/usb/%03d/%03d", std::stoi(readFrom(folder + "/busnum")),
                  std::stoi(readFrom(folder + "/devnum")));
    return fs::exists(text) ? text : std::string{};
  }
  return {};
}

void ReceiverGadget::grant() {
  std::string there = node();
  for (int tries = 0; there.empty() && tries < 1000; ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds{10});
    there = node();
  }
  if (chown(there.c_str(), 0, kBoxGroup) != 0 || chmod(there.c_str(), 0660) != 0) fail("the receiver's node " + there);
}

ReceiverPlayer::ReceiverPlayer(const std::vector<std::string>& arguments) {
  int commands[2];
  int answers[2];
  if (pipe2(commands, O_CLOEXEC) != 0 || pipe2(answers, O_CLOEXEC) != 0) fail("pipes to the player");
  std::vector<std::string> words{RECEIVER_PLAYER};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (auto& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, commands[0], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, answers[1], STDOUT_FILENO);
  errno = posix_spawn(&pid_, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(commands[0]);
  close(answers[1]);
  to_ = commands[1];
  from_ = answers[0];
  if (errno != 0) fail(words.front());
  readCounts();
}

ReceiverPlayer::~ReceiverPlayer() {
  close(std::exchange(to_, -1));  // that is how it is told to end
  reap();
  close(from_);
}

ReceiverPlayer::Counts ReceiverPlayer::tell(const std::string& command) {
  const std::string line = command + "\n";
  if (write(to_, line.data(), line.size()) != static_cast<ssize_t>(line.size())) fail("the player's commands");
  return readCounts();
}

ReceiverPlayer::Counts ReceiverPlayer::readCounts() {
  std::string line;
  for (char c = 0; c != '\n'; line += c) {
    if (read(from_, &c, 1) != 1) fail("the player has ended");
  }
  Counts counts;
  std::istringstream{line} >> counts.taken >> counts.delivered >> counts.withheld >> counts.refused >> counts.returned;
  return counts;
}

void ReceiverPlayer::kill() {
  ::kill(pid_, SIGKILL);
  reap();
}

void ReceiverPlayer::reap() {
  if (pid_ > 0) waitpid(std::exchange(pid_, 0), nullptr, 0);
}

}  // namespace probebox::vm
