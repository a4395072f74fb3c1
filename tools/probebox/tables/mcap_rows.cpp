#include "tools/probebox/tables/mcap_rows.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <limits>

#include "protocol/units/angle.hpp"
#include "tools/probebox/tables/tip_points.hpp"

namespace probebox::command {
namespace {

constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
constexpr std::size_t kChunkBytes = std::size_t{1} << 20U;  // a viewer reads and indexes whole chunks
constexpr std::size_t kRecordHead = 9;

enum class Op : std::uint8_t {
  header = 1,
  footer = 2,
  schema = 3,
  channel = 4,
  message = 5,
  chunk = 6,
  message_index = 7,
  chunk_index = 8,
  statistics = 11,
  metadata = 12,
  metadata_index = 13,
  summary_offset = 14,
  data_end = 15,
};

template <class T>
void put(std::string& bytes, T value) {
  for (std::size_t byte = 0; byte < sizeof(T); ++byte) bytes += static_cast<char>(value >> (8 * byte));
}

void putText(std::string& bytes, std::string_view text) {
  put(bytes, static_cast<std::uint32_t>(text.size()));
  bytes += text;
}

std::string record(Op op, std::string_view content) {
  std::string bytes;
  bytes.reserve(kRecordHead + content.size());
  bytes += static_cast<char>(op);
  put(bytes, std::uint64_t{content.size()});
  bytes += content;
  return bytes;
}

std::string mapOf(const std::map<McapFile::Id, std::uint64_t>& entries) {
  std::string bytes;
  for (const auto& [id, value] : entries) {
    put(bytes, id);
    put(bytes, value);
  }
  std::string all;
  putText(all, bytes);  // a map has its size in bytes in front, as a text has
  return all;
}

constexpr auto kCrcTable = [] {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t n = 0; n < table.size(); ++n) {
    std::uint32_t crc = n;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
    table[n] = crc;
  }
  return table;
}();

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

std::uint32_t crc32(std::string_view bytes) {
  std::uint32_t crc = ~std::uint32_t{0};
  for (const char byte : bytes) crc = (crc >> 8U) ^ kCrcTable[(crc ^ static_cast<unsigned char>(byte)) & 0xFFU];
  return ~crc;
}

McapFile::McapFile(Output& output) : output_{output} {
  std::string header;
  putText(header, "");  // no profile: the messages are nobody's convention
  putText(header, "probebox");
  write(kMagic);
  write(record(Op::header, header));
}

void McapFile::write(std::string_view bytes) {
  position_ += bytes.size();
  ok_ = ok_ && output_.write(bytes);
}

McapFile::Id McapFile::schema(std::string_view name, std::string_view definition) {
  std::string content;
  put(content, ++schemas_);
  putText(content, name);
  putText(content, "ros2msg");
  putText(content, definition);
  const auto bytes = record(Op::schema, content);
  definitions_ += bytes;
  chunk_ += bytes;
  return schemas_;
}

McapFile::Id McapFile::channel(std::string_view topic, Id schema) {
  std::string content;
  put(content, ++channels_);
  put(content, schema);
  putText(content, topic);
  putText(content, "cdr");
  put(content, std::uint32_t{0});  // no metadata
  const auto bytes = record(Op::channel, content);
  definitions_ += bytes;
  chunk_ += bytes;
  return channels_;
}

void McapFile::message(Id channel, std::uint64_t time_ns, std::string_view data) {
  auto& index = message_index_[channel];
  put(index, time_ns);
  put(index, std::uint64_t{chunk_.size()});
  const bool first_of_chunk = message_index_.size() == 1 && index.size() == 16;
  chunk_first_ns_ = first_of_chunk ? time_ns : std::min(chunk_first_ns_, time_ns);
  chunk_last_ns_ = first_of_chunk ? time_ns : std::max(chunk_last_ns_, time_ns);
  std::string content;
  content.reserve(22 + data.size());
  put(content, channel);
  put(content, static_cast<std::uint32_t>(counts_[channel]++));
  put(content, time_ns);  // of the log, and when it was published
  put(content, time_ns);
  content += data;
  chunk_ += record(Op::message, content);
  if (chunk_.size() >= kChunkBytes) endChunk();
}

void McapFile::endChunk() {
  if (message_index_.empty()) return;
  ChunkIndex entry{chunk_first_ns_, chunk_last_ns_, position_, 0, 0, chunk_.size(), {}};
  std::string content;
  put(content, entry.first_ns);
  put(content, entry.last_ns);
  put(content, entry.size);
  put(content, crc32(chunk_));
  putText(content, "");  // not compressed
  put(content, entry.size);
  content += chunk_;
  write(record(Op::chunk, content));
  entry.length = position_ - entry.begin;
  for (const auto& [channel, places] : message_index_) {
    entry.message_indices[channel] = position_;
    std::string index;
    put(index, channel);
    putText(index, places);
    write(record(Op::message_index, index));
  }
  entry.index_length = position_ - entry.begin - entry.length;
  first_ns_ = chunks_.empty() ? entry.first_ns : std::min(first_ns_, entry.first_ns);
  last_ns_ = std::max(last_ns_, entry.last_ns);
  chunks_.push_back(std::move(entry));
  chunk_.clear();
  message_index_.clear();
}

void McapFile::metadata(std::string_view name, const std::vector<std::pair<std::string, std::string>>& entries) {
  std::string pairs;
  for (const auto& [key, value] : entries) {
    putText(pairs, key);
    putText(pairs, value);
  }
  std::string content;
  putText(content, name);
  putText(content, pairs);
  const auto begin = position_;
  write(record(Op::metadata, content));
  metadata_.push_back({begin, position_ - begin, std::string{name}});
}

std::string McapFile::statistics() const {
  std::uint64_t messages = 0;
  for (const auto& [channel, count] : counts_) messages += count;
  std::string content;
  put(content, messages);
  put(content, schemas_);
  put(content, std::uint32_t{channels_});
  put(content, std::uint32_t{0});  // attachments
  put(content, static_cast<std::uint32_t>(metadata_.size()));
  put(content, static_cast<std::uint32_t>(chunks_.size()));
  put(content, first_ns_);
  put(content, last_ns_);
  return record(Op::statistics, content + mapOf(counts_));
}

void McapFile::finish() {
  endChunk();
  std::string no_crc;
  put(no_crc, std::uint32_t{0});
  write(record(Op::data_end, no_crc));
  summarize();
  write(kMagic);
}

// The summary: definitions, statistics and indices once more, with which a viewer opens the file without reading it
// all.
void McapFile::summarize() {
  const auto begin = position_;
  std::string summary = definitions_ + statistics();
  for (const auto& chunk : chunks_) {
    std::string content;
    for (const auto value : {chunk.first_ns, chunk.last_ns, chunk.begin, chunk.length}) put(content, value);
    content += mapOf(chunk.message_indices);
    put(content, chunk.index_length);
    putText(content, "");
    put(content, chunk.size);
    put(content, chunk.size);
    summary += record(Op::chunk_index, content);
  }
  for (const auto& entry : metadata_) {
    std::string content;
    put(content, entry.begin);
    put(content, entry.length);
    putText(content, entry.name);
    summary += record(Op::metadata_index, content);
  }
  // The CRC covers the summary and the footer up to the CRC itself.
  std::string footer;
  footer += static_cast<char>(Op::footer);
  put(footer, std::uint64_t{20});
  put(footer, begin);
  put(footer, std::uint64_t{0});  // no summary offsets
  summary += footer;
  put(summary, crc32(summary));
  write(summary);
}

void CdrMessage::align(std::size_t size) {
  constexpr std::size_t kFront = 4;
  while ((bytes_.size() - kFront) % size != 0) bytes_ += '\0';
}

CdrMessage& CdrMessage::add(double value) {
  align(sizeof value);
  put(bytes_, std::bit_cast<std::uint64_t>(value));
  return *this;
}

CdrMessage& CdrMessage::add(std::int64_t value) {
  align(sizeof value);
  put(bytes_, static_cast<std::uint64_t>(value));
  return *this;
}

CdrMessage& CdrMessage::add(std::uint8_t value) {
  bytes_ += static_cast<char>(value);
  return *this;
}

CdrMessage& CdrMessage::add(std::string_view text) {
  align(sizeof(std::uint32_t));
  put(bytes_, static_cast<std::uint32_t>(text.size() + 1));  // with the zero at its end
  bytes_ += text;
  bytes_ += '\0';
  return *this;
}

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
