#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "protocol/events/event.hpp"
#include "protocol/modbus/map.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::modbus {

// Modbus application protocol 1.1b3, section 7.
enum class ExceptionCode : std::uint8_t { illegal_address = 2, illegal_value = 3 };

// Why a write was refused; nothing changed.
struct WriteRefusal {
  ExceptionCode code;
  std::string_view reason;
};

// Request of a controller about a run or a result: registers 800 to 837. Options of zero mean the method's default.
struct ControllerRequest {
  enum class What : std::uint16_t { start = 1, abort = 2, accept = 3, accept_although_it_differs = 4 };
  std::uint16_t commit{};
  What what{};
  std::uint32_t of{};  // run or result
  std::uint16_t method{};
  ProcedureOptions options{};  // as requested
};

// Holds what the master of one line has written: word order, inhibit, and the marker, homing and pose in preparation.
class WritableRegisters {
 public:
  // Takes the whole write, or refuses it and changes nothing. Returns the resulting events: a marker, homed axes or a
  // pose when their commit register was written, and a change of inhibit. The caller sets the stamps.
  Outcome<std::vector<Event>, WriteRefusal> write(std::uint16_t first, std::span<const std::uint16_t> values);

  // Restores the stored choices after a restart of the box or when an unplugged line is back.
  void restore(WordOrder order, bool inhibits);
  // Call when the line was unplugged: discards markers, homings and poses in preparation.
  void restart() { *this = {}; }

  // The request that was committed last; commit 0: none yet.
  ControllerRequest controllerRequest() const;

  WordOrder wordOrder() const { return static_cast<WordOrder>(words_[address::word_order]); }

  // Copies the written values into an image, for reading back.
  void show(std::span<std::uint16_t, kRegisterCount> image) const;

 private:
  using Words = std::array<std::uint16_t, kRegisterCount>;
  static std::optional<WriteRefusal> check(const Words& words);
  static std::optional<WriteRefusal> checkMarker(const Words& words);
  static std::optional<WriteRefusal> checkHoming(const Words& words);
  static std::optional<WriteRefusal> checkPose(const Words& words);
  static std::optional<WriteRefusal> checkRequest(const Words& words);
  static std::optional<WriteRefusal> checkWhole(const Words& words, std::uint16_t first, std::size_t count);
  static PoseTold poseOf(const Words& words);
  static Marker markerOf(const Words& words);

  Words words_{};
};

}  // namespace probebox::modbus
