#include "firmware/app/wiring/outside_control.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <span>
#include <sstream>
#include <utility>

#include "protocol/units/angle.hpp"

namespace probebox::app {
namespace {

constexpr std::size_t kLongestLine = 512;
constexpr std::size_t kMostUnsent = 1U << 20U;  // a control that never reads its answers

}  // namespace

Outcome<std::unique_ptr<OutsideControl>> OutsideControl::open(const board::World& description, world::World& world) {
  TRY(auto listener, tcp::Listener::open({.host = "127.0.0.1", .port = description.outside_control->port}));
  return std::unique_ptr<OutsideControl>{new OutsideControl{description, world, std::move(listener)}};
}

OutsideControl::OutsideControl(const board::World& description, world::World& world, tcp::Listener listener)
    : swivels_head_{description.outside_control->b_swivels_head && description.swivel_head},
      tilts_table_{!description.outside_control->b_swivels_head && description.tilting_table},
      world_{world},
      following_{{.cycle = Nanoseconds{description.outside_control->cycle_ns}}, world},
      listener_{std::move(listener)} {}

void OutsideControl::serve(MonoTime now) {
  if (!control_) {
    control_ = listener_.accept();
    received_.clear();
    unsent_.clear();
  }
  if (!control_) return;
  receive();
  std::size_t begin = 0;
  for (auto end = received_.find('\n'); end != std::string::npos; end = received_.find('\n', begin)) {
    unsent_ += answer(std::string_view{received_}.substr(begin, end - begin), now) + '\n';
    begin = end + 1;
  }
  received_.erase(0, begin);
  send();
  if (received_.size() > kLongestLine || unsent_.size() > kMostUnsent) control_.reset();
}

void OutsideControl::receive() {
  std::array<std::byte, 4096> bytes{};
  while (control_) {
    const auto [count, state] = control_->read(bytes);
    received_.append(reinterpret_cast<const char*>(bytes.data()), count);
    if (state == io::PipeState::closed) control_.reset();
    if (count < bytes.size()) return;
  }
}

std::string OutsideControl::answer(std::string_view line, MonoTime now) {
  const auto space = line.find(' ');
  const auto number = line.substr(0, space);
  if (const auto wrong = take(space == std::string_view::npos ? "" : line.substr(space), now)) return "? " + *wrong;
  return std::string{number} + (world_.machine().touching() ? " 1 " : " 0 ") +
         std::to_string(world_.machine().crashes());
}

std::optional<std::string> OutsideControl::take(std::string_view values, MonoTime now) {
  std::istringstream words{std::string{values}};
  world::Lead lead;
  world::Vector3 angles_deg{};
  for (double& motor : lead.motor_mm) words >> motor;
  for (double& angle : angles_deg) words >> angle;
  words >> lead.tool;
  const bool complete = !words.fail();
  std::string mount, more;
  const bool has_mount = static_cast<bool>(words >> mount);
  const auto* const end = mount.data() + mount.size();
  const bool readable = !has_mount || std::from_chars(mount.data(), end, lead.mount).ptr == end;
  if (!complete || !readable || words >> more)
    return "a line is a number, X Y Z in mm, A B C in degrees, the tool's number, and the mount of the balls where it "
           "is "
           "not the first";
  const double b_rad = angles_deg[1] * kDegree;
  lead.pose = {.a_rad = angles_deg[0] * kDegree,
               .head_rad = swivels_head_ ? b_rad : 0,
               .table_rad = tilts_table_ ? b_rad : 0,
               .c_rad = angles_deg[2] * kDegree};
  return following_.take(lead, now);
}

void OutsideControl::send() {
  if (!control_ || unsent_.empty()) return;
  const auto [count, state] = control_->write(std::as_bytes(std::span{unsent_}));
  unsent_.erase(0, count);
  if (state == io::PipeState::closed) control_.reset();
}

}  // namespace probebox::app
