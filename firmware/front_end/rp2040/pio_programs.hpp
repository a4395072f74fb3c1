#pragma once
#include <array>
#include <cstdint>

#include "firmware/front_end/core/assembly.hpp"

// Programs of the state machines, with the encodings of the data sheet, 3.4. No instruction has a delay: what a cycle
// is for can be read from the list.
namespace probebox::front_end {
namespace pio_code {

using Code = std::uint16_t;
enum class When : unsigned { always = 0, x_counts = 2, y_counts = 4, x_is_not_y = 5 };
enum class Place : unsigned { pins = 0, x = 1, y = 2, null = 3, pin_directions = 4, pc = 5, isr = 6, osr = 7 };

constexpr Code jump(unsigned to, When when = When::always) {
  return static_cast<Code>(static_cast<unsigned>(when) << 5U | to);
}
constexpr Code in(Place from, unsigned bits) {
  return static_cast<Code>(0x4000U | static_cast<unsigned>(from) << 5U | bits);
}
constexpr Code out(Place to, unsigned bits) {
  return static_cast<Code>(0x6000U | static_cast<unsigned>(to) << 5U | bits);
}
constexpr Code move(Place to, Place from) {
  return static_cast<Code>(0xa000U | static_cast<unsigned>(to) << 5U | static_cast<unsigned>(from));
}
constexpr Code invert(Place to, Place from) {
  return static_cast<Code>(move(to, from) | 1U << 3U);
}
constexpr Code set(Place to, unsigned value) {
  return static_cast<Code>(0xe000U | static_cast<unsigned>(to) << 5U | value);
}
inline constexpr Code kPush = 0x8000;  // drops what does not fit
inline constexpr Code kPull = 0x80a0;
inline constexpr Code kIrqOfMachine = 0xc010;

}  // namespace pio_code

// Counts A (first pin) and B (second): y counts up when A leads B. A loop takes 11 cycles when the count grows, 8 when
// it falls, 5 when it stays; each state of A and B must last so long. The count is pushed when it changes. A and B that
// change at once set the interrupt flag of the machine's number.
namespace quadrature {
using namespace pio_code;
inline constexpr unsigned kTop = 16, kUp = 20, kDown = 24, kChanged = 25, kLast = 26, kIllegal = 27;
constexpr unsigned handlerOf(unsigned before, unsigned now) {
  constexpr std::array<unsigned, 4> kPhase{0, 1, 3, 2};  // of A | B << 1
  switch ((kPhase[now] - kPhase[before]) & 3U) {
    case 0:
      return kTop;
    case 1:
      return kUp;
    case 2:
      return kIllegal;
    default:
      return kDown;
  }
}
inline constexpr auto kProgram = [] {
  std::array<Code, 29> code{};
  for (unsigned before = 0; before < 4; ++before)
    for (unsigned now = 0; now < 4; ++now) code[4 * before + now] = jump(handlerOf(before, now));
  code[kTop] = out(Place::isr, 2);  // the state before
  code[17] = in(Place::pins, 2);    // and now
  code[18] = move(Place::osr, Place::isr);
  code[19] = move(Place::pc, Place::isr);  // to the table
  code[kUp] = invert(Place::y, Place::y);  // y + 1 = ~(~y - 1)
  code[21] = jump(22, When::y_counts);
  code[22] = invert(Place::y, Place::y);
  code[23] = jump(kChanged);
  code[kDown] = jump(kChanged, When::y_counts);
  code[kChanged] = move(Place::isr, Place::y);
  code[kLast] = kPush;
  code[kIllegal] = kIrqOfMachine;
  code[28] = jump(kTop);
  return code;
}();
}  // namespace quadrature

// Stamps changes of five pins: a loop of kCyclesAStep cycles decrements the counter in isr; where the pins are others
// than in y, counter and pins are pushed, which takes the time of one more step and is counted so.
namespace stamper {
using namespace pio_code;
inline constexpr unsigned kChanged = 0, kTop = 9, kLast = 14;
inline constexpr std::array<Code, 15> kProgram{
    move(Place::y, Place::x),    move(Place::osr, Place::isr),
    in(Place::y, kStampedPins),  kPush,
    move(Place::x, Place::osr),  jump(6, When::x_counts),
    jump(7, When::x_counts),     move(Place::isr, Place::x),
    move(Place::y, Place::y),    move(Place::osr, Place::pins),
    out(Place::x, kStampedPins), jump(kChanged, When::x_is_not_y),
    move(Place::x, Place::isr),  jump(14, When::x_counts),
    move(Place::isr, Place::x),
};
}  // namespace stamper

// A square wave whose half period is osr + 4 cycles; y is pushed at the rising edge.
namespace pacer {
using namespace pio_code;
inline constexpr unsigned kTop = stamper::kProgram.size(), kLast = kTop + 7;
inline constexpr std::array<Code, 8> kProgram{
    move(Place::x, Place::osr),
    set(Place::pins, 1),
    move(Place::isr, Place::y),
    kPush,
    jump(kTop + 4, When::x_counts),
    move(Place::x, Place::osr),
    set(Place::pins, 0),
    jump(kTop + 7, When::x_counts),
};
constexpr std::uint32_t reloadOf(std::uint32_t steps) {
  return steps * kCyclesAStep / 2 - 4;
}
static_assert(kCyclesAStep % 2 == 0);
}  // namespace pacer

}  // namespace probebox::front_end
