#include "tools/probebox/tables/mcap_rows.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

#include "protocol/units/angle.hpp"
#include "tools/probebox/tables/tip_points.hpp"

namespace probebox::command {
namespace {

// Letters, digits and single underscores, with a letter in front: what ROS takes for the name of a field.
std::string mcapFieldName(const messages::ChannelDescription& channel, const std::string& so_far) {
  std::string name;
  for (const char c : columnName(channel)) {
    const bool usual = std::isalnum(static_cast<unsigned char>(c)) != 0;
    if (usual) name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (!usual && !name.empty() && name.back() != '_') name += '_';
  }
  while (!name.empty() && name.back() == '_') name.pop_back();
  if (name.empty() || std::isalpha(static_cast<unsigned char>(name.front())) == 0) name = "c" + name;
  while (so_far.find(" " + name + "\n") != std::string::npos) name += "x";
  return name;
}

std::uint64_t nsOf(MonoTime time) {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, toNs(time)));
}

std::vector<std::pair<std::string, std::string>> aboutTheBox(const messages::Descriptor& descriptor) {
  return {{"board", descriptor.board},
          {"serial_number", descriptor.serial_number},
          {"firmware_version", descriptor.firmware_version},
          {"machine", descriptor.machine},
          {"probe", descriptor.probe},
          {"tick_period_ns", std::to_string(descriptor.nominal_tick_period_ns)},
          {"samples_per_tick", std::to_string(descriptor.samples_per_tick)},
          {"time", "ns since the boot of the box, monotonic"}};
}

// Fields of a trigger, once for the definition and once for the values.
void fieldsOf(const messages::Trigger& t, auto&& field) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  constexpr std::string_view kAxes = "xyzabc";
  const auto known = [](std::uint8_t mask, std::size_t axis) { return (unsigned{mask} >> axis & 1U) != 0; };
  field("int64", "number", std::int64_t{t.number});
  field("int64", "line", std::int64_t{t.line});
  field("int64", "tick", t.tick.index);
  field("float64", "phase", std::ldexp(t.phase_q32, -32));
  field("float64", "sigma_ns", double{1} * t.sigma_ns);
  for (std::size_t k = 0; k < 3; ++k)
    field("float64", std::string{kAxes[k]} + "_mm", known(t.has_position, k) ? t.position_mm[k] : kUnknown);
  for (std::size_t k = 0; k < 3; ++k)
    field("float64", std::string{kAxes[k + 3]} + "_deg", known(t.has_angle, k) ? degrees(t.angle_rad[k]) : kUnknown);
  for (std::size_t k = 0; k < 3; ++k)
    field("float64", std::string{"correction_"} + kAxes[k] + "_mm", t.correction_mm[k]);
  field("uint8", "correction_valid", std::uint8_t{t.correction_valid});
}

}  // namespace

void McapRows::begin(const messages::Descriptor& descriptor) {
  auto output = Output::open(job_.output, job_.force, standard_);
  if (!output) {
    failure_ = output.error().what;
    return;
  }
  output_.emplace(std::move(output).value());
  file_.emplace(*output_);
  file_->metadata("probebox", aboutTheBox(descriptor));
  declare(descriptor);
}

void McapRows::declare(const messages::Descriptor& descriptor) {
  std::string sample = "int64 sample\n";
  for (const auto& channel : descriptor.channels) sample += "float64 " + mcapFieldName(channel, sample) + "\n";
  samples_ = file_->channel("/probebox/samples", file_->schema("probebox/msg/Sample", sample));
  gaps_ = file_->channel("/probebox/gaps",
                         file_->schema("probebox/msg/Gap", "int64 first_sample\nint64 samples\nstring reason\n"));
  if (job_.points != nullptr) {
    std::string point = "int64 sample\n";
    for (const auto name : kPointColumns) point += "float64 " + std::string{name} + "\n";
    points_ = file_->channel("/probebox/points", file_->schema("probebox/msg/Point", point));
  }
  std::string trigger;
  fieldsOf({}, [&](std::string_view type, std::string_view name, auto) {
    trigger += std::string{type} + " " + std::string{name} + "\n";
  });
  triggers_ = file_->channel("/probebox/triggers", file_->schema("probebox/msg/Trigger", trigger));
  std::string delay = "int64 result_id\n";
  for (const auto* name : {"tau_x_s", "tau_y_s", "tau_z_s", "sd_x_s", "sd_y_s", "sd_z_s"})
    delay += "float64 " + std::string{name} + "\n";
  delays_ = file_->channel("/probebox/delay", file_->schema("probebox/msg/Delay", delay));
}

void McapRows::put(McapFile::Id channel, std::uint64_t time_ns, const CdrMessage& message) {
  if (failure_ || !file_) return;
  file_->message(channel, time_ns, message.bytes());
  if (!file_->ok()) failure_ = output_->failure();
}

void McapRows::tellDelay(const messages::DelayInForce& delay, std::uint64_t time_ns) {
  if (delay_told_ == delay.result_id) return;
  delay_told_ = delay.result_id;
  CdrMessage message;
  message.add(static_cast<std::int64_t>(delay.result_id));
  for (const auto tau : delay.tau_s) message.add(tau);
  for (const auto sd : delay.sd_s) message.add(sd);
  put(delays_, time_ns, message);
}

void McapRows::enter(const messages::Descriptor& descriptor) {
  scales_.clear();
  for (const auto& channel : descriptor.channels) scales_.emplace_back(channel.scale);
}

void McapRows::row(const link::DecodedBlock& block, std::size_t k, SampleIndex sample) {
  const auto& channels = block.descriptor.channels;
  newest_ns_ = nsOf(codec::timeOf(block.header, sample));
  tellDelay(block.descriptor.delay, newest_ns_);
  CdrMessage message;
  message.add(sample.index);
  for (std::size_t c = 0; c < channels.size(); ++c) message.add(scales_[c].value(block.column(c)[k]));
  put(samples_, newest_ns_, message);
  if (job_.points != nullptr) tellPoint(block, k, sample);
}

void McapRows::tellPoint(const link::DecodedBlock& block, std::size_t k, SampleIndex sample) {
  const auto& point = job_.points->of(block, k);
  if (!point.hasTip()) return;
  CdrMessage message;
  message.add(sample.index);
  for (const double value : valuesOf(point)) message.add(value);
  put(points_, newest_ns_, message);
}

// A gap has no time of its own: the last sample before it does.
void McapRows::missing(SampleIndex first, std::uint64_t count, std::string_view reason) {
  put(gaps_, newest_ns_, CdrMessage{}.add(first.index).add(static_cast<std::int64_t>(count)).add(reason));
}

void McapRows::trigger(const messages::Trigger& trigger) {
  CdrMessage message;
  fieldsOf(trigger, [&](auto, auto, auto value) { message.add(value); });
  put(triggers_, nsOf(trigger.at), message);
}

void McapRows::end() {
  if (failure_ || !file_) return;
  file_->finish();
  if (!file_->ok() || !output_->finish()) failure_ = output_->failure();
}

}  // namespace probebox::command
