#include "tools/probebox/commands/update_front_end.hpp"

#include <algorithm>
#include <chrono>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <sstream>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

#include "board/describe/file_content.hpp"
#include "drivers/io/descriptor.hpp"
#include "drivers/usb_host/linux_access.hpp"
#include "drivers/usb_probe/front_end.hpp"
#include "tools/probebox/commands/front_end_image.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/settled_status.hpp"

namespace probebox::command {
namespace {

namespace fs = std::filesystem;

using usb_host::VendorRequests;
using usb_probe::FrontEnd;

constexpr std::size_t kMostImageBytes = 4U << 20U;
constexpr double kMostPatience_s = 60;
constexpr milliseconds kLookEvery{250}, kMountPatience{5000};
constexpr const char* kLabel = "/dev/disk/by-label/RPI-RP2";

Trouble refused(std::string name, std::string what) {
  return {ExitStatus::box_refused, std::move(name), std::move(what)};
}

// The boot loader's drive tells what it is in a file.
bool isDriveOfBootLoader(const fs::path& folder) {
  const auto info = board::fileContent(folder / "INFO_UF2.TXT", 4096);
  return info && info->find("RPI-RP2") != std::string::npos;
}

std::optional<fs::path> findDrive(const std::string& given) {
  if (!given.empty()) return isDriveOfBootLoader(given) ? std::optional{fs::path{given}} : std::nullopt;
  std::ifstream mounts{"/proc/self/mounts"};
  for (std::string line; std::getline(mounts, line);) {
    std::istringstream words{line};
    std::string device, folder, kind;
    words >> device >> folder >> kind;
    for (auto at = folder.find("\\040"); at != std::string::npos; at = folder.find("\\040")) folder.replace(at, 4, " ");
    if (kind == "vfat" && isDriveOfBootLoader(folder)) return folder;
  }
  return std::nullopt;
}

// The drive disappears as soon as it has the last block, so that only the bytes before it are sure to be taken.
bool copyTo(const fs::path& drive, std::string_view image) {
  const io::Descriptor file{::open((drive / "front_end.uf2").c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644)};
  if (file.get() < 0) return false;
  while (!image.empty()) {
    const auto written = ::write(file.get(), image.data(), image.size());
    if (written <= 0) return false;
    image.remove_prefix(static_cast<std::size_t>(written));
  }
  ::fsync(file.get());
  return true;
}

class FrontEndUpdate {
 public:
  FrontEndUpdate(const Update& options, const std::string& given, std::string image, const FrontEndImage& checked,
                 Console& console)
      : options_{options},
        given_{given},
        image_{std::move(image)},
        version_{checked.version},
        serial_{options.receiver},
        patience_{inMilliseconds(std::min(options.patience_s, kMostPatience_s))},
        console_{console} {}

  std::optional<Trouble> go() {
    drive_ = findDrive(options_.drive);
    if (auto trouble = drive_ || isNotMounted() ? whyTwoChips() : restartIntoBootLoader()) return trouble;
    until("waiting for the drive of the front end's boot loader",
          [this] { return (drive_ = findDrive(options_.drive)).has_value() || nobodyMountsIt(); });
    if (!drive_ && console_.interrupted())
      return Trouble{ExitStatus::interrupted, "interrupted",
                     "interrupted: the front end waits in its boot loader; give the same command again, or plug it in "
                     "again"};
    if (!drive_) return noDrive();
    console_.note("copying " + usb_probe::versionText(version_) + " to " + drive_->string());
    if (!copyTo(*drive_, image_))
      return Trouble{ExitStatus::failed, "not-written",
                     drive_->string() +
                         " does not take the file: see that you may write there, and give the same "
                         "command again"};
    std::optional<FrontEnd> now;
    if (!until("waiting for the front end", [&] { return (now = answering()).has_value(); }))
      return console_.interrupted()
                 ? interruption()
                 : Trouble{ExitStatus::failed, "not-back",
                           "the front end has not come back: plug it in again; if it stays away, hold its button "
                           "BOOTSEL while you do, and give the same command again"};
    after_ = now->identity.version;
    if (after_ == version_) return std::nullopt;
    return Trouble{ExitStatus::failed, "version-differs",
                   "the front end runs version " + usb_probe::versionText(after_) + " and not " +
                       usb_probe::versionText(version_) + " of the file: give the same command again"};
  }

  void tell() const {
    const auto after = usb_probe::versionText(after_);
    if (console_.json())
      console_.object({{"serial_number", serial_},
                       {"version_before", before_ ? Json(usb_probe::versionText(*before_)) : Json(nullptr)},
                       {"version", after},
                       {"drive", drive_->string()}});
    else
      console_.line("done: the front end " + serial_ + " runs version " + after);
  }

 private:
  // A chip that waits in its boot loader does not tell which one it is.
  std::optional<Trouble> whyTwoChips() {
    const auto context = usb_host::Context::open();
    if (!context) return std::nullopt;
    for (const auto& device : usb_host::devices(*context, usb::kReceiver)) others_.push_back(device.name());
    if (others_.empty() || !options_.drive.empty()) return std::nullopt;
    return refused("two-chips", "a chip waits in its boot loader (" + (drive_ ? drive_->string() : kLabel) +
                                    "), and the front end " + others_.front() +
                                    " runs: name the drive with --drive, or unplug the other");
  }

  // One that waits in its boot loader is no receiver.
  std::optional<Trouble> restartIntoBootLoader() {
    const auto context = usb_host::Context::open();
    if (!context) return Trouble{ExitStatus::no_box, "no-usb", context.error().what};
    const auto device =
        usb_host::choose(usb_host::devices(*context, usb::kReceiver), options_.receiver, usb::kReceiver);
    if (!device) return Trouble{ExitStatus::no_box, "no-front-end", device.error().what};
    const auto requests = VendorRequests::open(*device);
    if (!requests) return whyNotOpened(*device, requests.error());
    const auto front_end = usb_probe::askFrontEnd(*requests);
    if (!front_end)
      return refused("another-receiver", "usb:" + device->name() +
                                             " is another receiver than this project's front end: update it as its "
                                             "maker says");
    serial_ = device->serial_number;
    before_ = front_end->identity.version;
    if (!options_.force && version_ <= *before_)
      return refused("not-newer", "the front end runs version " + usb_probe::versionText(*before_) +
                                      " already, and the file has " + usb_probe::versionText(version_) +
                                      ": add --force to install it");
    if (auto trouble = whyInUse(*device)) return trouble;
    if (requests->write(static_cast<std::uint8_t>(front_end::Request::boot_loader), front_end::kBootLoaderKey))
      return std::nullopt;
    return refused("no-boot-loader",
                   "the front end does not restart into its boot loader: hold its button BOOTSEL "
                   "while you plug it in, and give the same command again");
  }

  // The rule for the box's own user (60-probeboxd.rules) gives it to a group, the one for a person does not.
  static Trouble whyNotOpened(const usb_host::Device& device, const usb_host::OpenError& error) {
    if (error.kind != usb_host::OpenError::Kind::no_permission) return {ExitStatus::no_box, "no-front-end", error.what};
    return {ExitStatus::no_box, "no-permission",
            "usb:" + device.name() + ": no permission to open " + device.node +
                "; run it as root, or as a member of group probebox"};
  }

  // Who reads it loses it for a while. A box answers for the one that it reads alone.
  std::optional<Trouble> whyInUse(const usb_host::Device& device) const {
    if (usb_host::accessTo(device) != usb_host::Access::busy) return std::nullopt;
    const auto uri = chooseUri(given_);
    if (uri && !uri->isFile()) {
      if (const auto box = openBox(*uri, console_)) {
        TRY(const auto status, ask<messages::Status>(**box, console_));
        if (status.front_end.serial_number == device.serial_number) return whyNotAtRest(**box, console_);
      }
    }
    return refused("in-use", "usb:" + device.name() + " is in use by " + usb_host::holderOf(device) +
                                 ", and no box that reads it answers whether a run or a cut is on: name that box "
                                 "with -u, or end that program");
  }

  std::optional<FrontEnd> answering() {
    const auto context = usb_host::Context::open();
    if (!context) return std::nullopt;
    auto there = usb_host::devices(*context, usb::kReceiver);
    std::erase_if(there, [this](const auto& each) { return std::ranges::find(others_, each.name()) != others_.end(); });
    const auto device = usb_host::choose(there, serial_, usb::kReceiver);
    if (!device) return std::nullopt;
    serial_ = device->serial_number;
    const auto requests = VendorRequests::open(*device);
    return requests ? usb_probe::askFrontEnd(*requests) : std::nullopt;
  }

  bool isNotMounted() const {
    std::error_code none;
    return options_.drive.empty() && fs::exists(kLabel, none);
  }

  // A desktop takes a moment to mount it.
  bool nobodyMountsIt() {
    if (!isNotMounted()) return false;
    if (!label_since_) label_since_ = link::now();
    return link::now() > *label_since_ + kMountPatience;
  }

  Trouble noDrive() const {
    if (label_since_)
      return {ExitStatus::failed, "not-mounted",
              std::string{"the drive of the boot loader is there, and not mounted: mount "} + kLabel +
                  ", and give the same command with --drive and the folder"};
    return {ExitStatus::failed, "no-drive",
            (options_.drive.empty() ? std::string{"no drive RPI-RP2 has appeared"}
                                    : options_.drive + " is not the drive of the boot loader (INFO_UF2.TXT)") +
                ": mount it, and give the same command with --drive and its folder"};
  }

  bool until(const std::string& what, const std::function<bool()>& done) {
    for (const auto deadline = link::now() + patience_; !done();) {
      if (console_.interrupted() || link::now() > deadline) return false;
      console_.progress(what);
      std::this_thread::sleep_for(kLookEvery);
    }
    return true;
  }

  const Update& options_;
  const std::string& given_;
  std::string image_;
  std::uint16_t version_;
  std::string serial_;
  Nanoseconds patience_;
  Console& console_;
  std::optional<fs::path> drive_;
  std::optional<MonoTime> label_since_;  // the drive is there, not mounted
  std::vector<std::string> others_;      // receivers that ran while the chip waited in its boot loader
  std::optional<std::uint16_t> before_;
  std::uint16_t after_{};
};

}  // namespace

ExitStatus updateFrontEnd(const Update& options, const std::string& given, Console& console) {
  auto image = board::fileContent(options.front_end, kMostImageBytes);
  if (!image) return console.fail({ExitStatus::usage, "not-read", options.front_end + ": " + image.error().what});
  const auto checked = checkFrontEndImage(*image);
  if (!checked)
    return console.fail({ExitStatus::usage, checked.error().name, options.front_end + ": " + checked.error().what});
  FrontEndUpdate update{options, given, std::move(*image), *checked, console};
  if (auto trouble = update.go()) return console.fail(std::move(*trouble));
  update.tell();
  return ExitStatus::ok;
}

}  // namespace probebox::command
