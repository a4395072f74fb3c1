#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/front_end/core/assembly.hpp"

// The control endpoint of the front end: USB 2.0, chapter 9, and the vendor requests of
// protocol/receiver/front_end.hpp. Pure: set-up packets and data in, answers out.
namespace probebox::front_end {

inline constexpr std::size_t kControlBytes = 64;  // of a packet on endpoint 0
inline constexpr std::size_t kBulkBytes = 64;

struct Answer {
  enum class Kind : std::uint8_t {
    stall,
    in,           // send `bytes`, then expect the status stage
    out,          // expect `expected` bytes, which go to data()
    acknowledge,  // send the status stage
  };
  Kind kind{Kind::stall};
  std::span<const std::byte> bytes{};
  std::size_t expected{};
};

class Control {
 public:
  // serial: printable characters, such as the identity of the flash.
  Control(Assembly& assembly, std::span<const char> serial);

  Answer setup(std::span<const std::byte, 8> packet);
  // The data that an Answer of kind `out` expects.
  Answer data(std::span<const std::byte> bytes);
  // The bus was reset.
  void reset();

  std::uint8_t address() const { return address_; }  // in force after the status stage
  bool configured() const { return configured_; }
  bool halted() const { return halted_; }  // the bulk endpoint

  // What a request asked for, once.
  std::optional<Settings> takeSettings();
  bool takeNewHost();  // begin with DATA0, discard what is queued
  bool takeBootLoader();

 private:
  struct Setup;
  Answer standard(const Setup& setup);
  Answer descriptor(const Setup& setup);
  Answer feature(const Setup& setup, bool on);
  Answer vendor(const Setup& setup);
  template <class T>
  Answer structure(const T& value, const Setup& setup);
  Answer refuse(RefusalCode code);
  Answer give(std::size_t size, const Setup& setup);

  Assembly& assembly_;
  std::array<char, 16> serial_{};
  std::size_t serial_size_{};
  std::array<std::byte, 128> bytes_{};
  std::uint8_t address_{};
  bool configured_{}, halted_{}, new_host_{}, boot_loader_{};
  std::optional<Settings> settings_;
};

}  // namespace probebox::front_end
