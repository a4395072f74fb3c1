#include "mock_device.hpp"

#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <sys/stat.h>
#include <umockdev.h>
#include <unistd.h>
#include <utility>

namespace probebox::iio {
namespace {

using Attributes = std::map<std::string, std::string>;

class UmockdevDevice final : public MockDevice {
 public:
  explicit UmockdevDevice(const Attributes& attributes) : bed_{umockdev_testbed_new()} {
    auto* const root = umockdev_testbed_get_root_dir(bed_);
    root_ = root;
    g_free(root);
    std::filesystem::create_directories(root_ / "dev");
    addAnother(kNumber, attributes);
    node_ = root_ / "dev" / kNumber;
    makeNode();
  }

  ~UmockdevDevice() override {
    if (writer_ >= 0) close(writer_);
    g_object_unref(bed_);
  }

  void set(const std::string& attribute, const std::string& text) override {
    std::filesystem::create_directories((folder() / attribute).parent_path());
    // At once, as the kernel does, for a driver that reads meanwhile.
    std::ofstream{root_ / "new"} << text << "\n";
    std::filesystem::rename(root_ / "new", folder() / attribute);
  }

  std::string get(const std::string& attribute) const override {
    std::string line;
    std::getline(std::ifstream{folder() / attribute}, line);
    return line;
  }

  void remove(const std::string& attribute) override { std::filesystem::remove(folder() / attribute); }

  void addAnother(const std::string& number, const Attributes& attributes) override {
    const auto folder = root_ / "sys/bus/iio/devices" / number;
    for (const auto& [attribute, text] : attributes) {
      std::filesystem::create_directories((folder / attribute).parent_path());
      std::ofstream{folder / attribute} << text << "\n";
    }
  }

  void send(std::span<const std::byte> bytes) override {
    if (write(writer_, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size()))
      throw std::runtime_error{"the node is full"};
  }

  void unplug() override {
    close(std::exchange(writer_, -1));
    std::filesystem::remove(node_);
    std::filesystem::rename(folder(), away());
  }

  void plugIn() override {
    std::filesystem::rename(away(), folder());
    set("buffer/enable", "0");
    makeNode();
  }

 private:
  std::filesystem::path folder() const { return root_ / "sys/bus/iio/devices" / kNumber; }
  std::filesystem::path away() const { return root_ / "away"; }

  // A pipe gives to read what is written to it, says that there is nothing now, and ends when its writer goes.
  void makeNode() {
    if (mkfifo(node_.c_str(), 0600) != 0) throw std::runtime_error{"no mock node"};
    writer_ = open(node_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (writer_ < 0) throw std::runtime_error{"no mock node"};
  }

  UMockdevTestbed* bed_;
  std::filesystem::path root_;
  std::filesystem::path node_;
  int writer_{-1};
};

}  // namespace

std::unique_ptr<MockDevice> makeMockDevice(const Attributes& attributes) {
  return std::make_unique<UmockdevDevice>(attributes);
}

}  // namespace probebox::iio
