#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "drivers/io/descriptor.hpp"
#include "firmware/store/twin_file.hpp"
#include "protocol/frame/sha256.hpp"
#include "protocol/messages/updates.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Facts about an update bundle that its sender states before sending it.
struct Bundle {
  std::string name;
  std::string version;
  std::uint64_t total_bytes{};
  messages::Sha256 sha256{};
};

// Keeps one bundle that a host sends, in the file `bundle` of its folder, and beside it (`offer`) which one it is and
// how much of it is on the disk. After a restart it goes on there. For the worker's thread.
class BundleFile {
 public:
  static constexpr std::uint64_t kSpare = 16U << 20U;  // bytes that a bundle leaves free for results
  static constexpr std::uint64_t kMost = 200U << 20U;  // bytes that the updater takes

  // Makes the folder where it is missing.
  explicit BundleFile(std::filesystem::path folder);

  // Null while there is none.
  const Bundle* bundle() const { return bundle_ ? &*bundle_ : nullptr; }
  std::uint64_t received() const { return received_; }
  std::uint64_t stored() const { return stored_; }
  bool complete() const { return bundle_ && received_ == bundle_->total_bytes; }
  // Names what the bundle was handed over for; 0: not handed over.
  std::uint64_t installation() const { return installation_; }

  // Keeps what is there of the same bundle, drops another one. Errors: too-large, disk-full (no room for it and for the
  // copy that the updater makes).
  std::optional<Error> begin(const Bundle& bundle);
  // Adds what follows received(). On an error (disk-full or the disk's own) everything is dropped: results need room.
  std::optional<Error> append(std::span<const std::byte> bytes);
  // Everything received is on the disk when this returns.
  std::optional<Error> store();
  // Notes on the disk that the bundle is handed over (0: no longer).
  std::optional<Error> setInstallation(std::uint64_t installation);
  void drop();

  // Compares the whole file with its SHA-256, a piece at each call: beginCheck(), then check() until it is decided.
  enum class Check : std::uint8_t { going_on, good, bad };
  void beginCheck();
  Outcome<Check> check();
  std::uint8_t checkedPercent() const;

 private:
  void restore();
  Outcome<void> open();
  std::optional<Error> fail(const std::string& doing, int error);
  std::optional<Error> note(std::uint64_t stored, std::uint64_t installation);

  std::filesystem::path folder_;
  store::TwinFile offer_;
  io::Descriptor file_;
  std::optional<Bundle> bundle_;
  std::uint64_t received_{};
  std::uint64_t stored_{};
  std::uint64_t installation_{};
  frame::Sha256 hash_;
  std::uint64_t hashed_{};
};

}  // namespace probebox::app
