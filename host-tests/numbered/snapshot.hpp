#pragma once
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware/modbus/rtu_requests.hpp"
#include "protocol/modbus/map.hpp"
#include "protocol/state/snapshot.hpp"

// Snapshots in which every value says the same number, so that a mixture of two shows.
namespace probebox::support {

inline constexpr std::uint16_t kNumberedRegisters = 122;  // from 0 on

// Of the correction, 0.1 um; within what the registers can say.
constexpr int countOf(std::uint32_t number) {
  return static_cast<int>(number % 60'001U) - 30'000;
}

inline published::Snapshot numbered(std::uint32_t number) {
  published::Snapshot snapshot;
  const double mm = countOf(number) * 1e-4;
  snapshot.valid = true;
  snapshot.correction_mm = {mm, -mm, mm};
  snapshot.sequence = snapshot.heartbeat = static_cast<std::uint16_t>(number);
  snapshot.ledger.produced = snapshot.ledger.lost_at_source = snapshot.ledger.lost_in_queue = number;
  snapshot.delay.calibrated = true;
  snapshot.delay.result_id = number;
  snapshot.last_trigger.number = number;
  snapshot.calibration_run = number;
  snapshot.calibration_step = static_cast<std::uint16_t>(number);  // a register of 16 bits, which saturates
  snapshot.calibration_result_id = number;
  return snapshot;
}

inline std::optional<std::string> whyTorn(const published::Snapshot& snapshot) {
  const auto number = static_cast<std::uint32_t>(snapshot.ledger.produced);
  const double mm = countOf(number) * 1e-4;
  const bool is_new = number == 0;  // nothing was published yet
  const bool whole = snapshot.correction_mm == std::array{mm, -mm, mm} &&
                     snapshot.sequence == static_cast<std::uint16_t>(number) &&
                     snapshot.heartbeat == snapshot.sequence && snapshot.ledger.lost_at_source == number &&
                     snapshot.ledger.lost_in_queue == number && snapshot.delay.result_id == number &&
                     snapshot.last_trigger.number == number && snapshot.calibration_run == number &&
                     snapshot.calibration_result_id == number;
  if (whole || is_new) return std::nullopt;
  return "a snapshot mixes " + std::to_string(number) + " and others";
}

// Registers 0 to 121 of an answer.
inline std::optional<std::string> whyTorn(std::span<const std::uint16_t> registers) {
  namespace address = modbus::address;
  const auto u32 = [&](std::size_t at) { return std::uint32_t{registers[at]} << 16U | registers[at + 1]; };
  const auto number = u32(address::samples_produced);
  if (number == 0) return std::nullopt;
  const std::array counts{countOf(number), -countOf(number), countOf(number)};
  for (std::size_t axis = 0; axis < counts.size(); ++axis) {
    const auto count = static_cast<std::int16_t>(registers[address::correction_i16 + axis]);
    const auto nm = std::bit_cast<std::int32_t>(u32(address::correction_i32 + 2 * axis));
    const auto mm = std::bit_cast<float>(u32(address::correction_f32 + 2 * axis));
    const bool agree = count == counts[axis] && registers[address::correction_offset + axis] == count + 32768 &&
                       nm == count * 100 && std::abs(static_cast<double>(mm) - count * 1e-4) < 1e-6;
    if (!agree) return "the formats of axis " + std::to_string(axis) + " differ at " + std::to_string(number);
  }
  const auto low = static_cast<std::uint16_t>(number);
  const bool whole = registers[address::sequence] == low && registers[address::heartbeat] == low &&
                     u32(address::samples_lost_at_source) == number && u32(address::samples_lost_in_queue) == number &&
                     u32(address::delay_result) == number && u32(address::calibration_run) == number &&
                     u32(address::calibration_result) == number && registers[address::calibration_step] == low;
  return whole ? std::nullopt : std::optional{"registers of " + std::to_string(number) + " and of others in one read"};
}

inline modbus::Request readRequest(std::uint16_t first, std::uint16_t count) {
  modbus::Request request;
  request.size = 8;
  const std::array<unsigned, 6> head{1, 3, unsigned{first} >> 8U, first & 0xFFU, unsigned{count} >> 8U, count & 0xFFU};
  for (std::size_t i = 0; i < head.size(); ++i) request.bytes[i] = static_cast<std::uint8_t>(head[i]);
  const auto crc = modbus::crc16(std::span{request.bytes}.first(6));
  request.bytes[6] = static_cast<std::uint8_t>(crc);
  request.bytes[7] = static_cast<std::uint8_t>(crc >> 8U);
  return request;
}

// Of an answer on a serial line.
inline std::vector<std::uint16_t> registersOf(std::span<const std::uint8_t> frame) {
  std::vector<std::uint16_t> values;
  for (std::size_t at = 3; at + 3 < frame.size(); at += 2)
    values.push_back(static_cast<std::uint16_t>(frame[at] << 8U | frame[at + 1]));
  return values;
}

}  // namespace probebox::support
