#include "tools/probebox/tables/npy_rows.hpp"

#include <array>
#include <bit>
#include <cctype>
#include <iostream>
#include <utility>

#include "protocol/frame/bytes.hpp"
#include "tools/probebox/tables/tip_points.hpp"

namespace probebox::command {
namespace {

constexpr std::size_t kCountWidth = 20;  // digits of the number of rows, filled up with spaces

// Names that no channel may have.
std::string ownFields() {
  std::string names = "('delay_result_id', ('tau_x_s', ('tau_y_s', ('tau_z_s',";
  for (const auto name : kPointColumns) names += " ('" + std::string{name} + "',";
  return names;
}

// Quotes and what is not ASCII would need care in the header, and numpy takes no name twice.
std::string npyFieldName(const messages::ChannelDescription& channel, const std::string& so_far) {
  std::string name = columnName(channel);
  for (auto& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  while (so_far.find("('" + name + "',") != std::string::npos) name += '_';
  return name;
}

std::string field(const std::string& name, const std::string& type) {
  return "('" + name + "', '" + type + "'), ";
}

std::string typeOf(const messages::ChannelDescription& channel) {
  if (channel.scale != 1.0) return "<f8";
  const std::string order = channel.bytes == 1 ? "|" : "<";
  return order + (channel.is_signed ? "i" : "u") + std::to_string(channel.bytes);
}

}  // namespace

template <class T>
void NpyRows::put(T value) {
  std::array<std::byte, sizeof(T)> bytes{};
  frame::ByteWriter{bytes}.put(value);
  row_.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

void NpyRows::begin(const messages::Descriptor& descriptor) {
  auto output = Output::open(job_.output, job_.force, std::cout);
  if (!output) {
    failure_ = output.error().what;
    return;
  }
  output_.emplace(std::move(output).value());
  types_ = typesOf(descriptor);
  writeHeader();
}

std::string NpyRows::typesOf(const messages::Descriptor& descriptor) const {
  std::string types = field("sample", "<i8") + field("time_ns", "<i8");
  for (const auto& channel : descriptor.channels)
    types += field(npyFieldName(channel, types + ownFields()), typeOf(channel));
  types += field("delay_result_id", "<u8");
  for (const auto* name : {"tau_x_s", "tau_y_s", "tau_z_s"}) types += field(name, "<f8");
  if (job_.points != nullptr)
    for (const auto name : kPointColumns) types += field(std::string{name}, "<f8");
  return types;
}

std::string npyHeader(const std::string& types, std::uint64_t rows) {
  constexpr std::size_t kPreamble = 10;
  std::string count = std::to_string(rows) + ",";
  count.resize(kCountWidth + 1, ' ');
  std::string header = "{'descr': [" + types + "], 'fortran_order': False, 'shape': (" + count + "), }";
  header.resize((kPreamble + header.size() + 1 + 63) / 64 * 64 - kPreamble - 1, ' ');
  header += '\n';
  std::string preamble = "\x93NUMPY\x01";
  preamble += '\0';
  preamble += static_cast<char>(header.size() & 0xFFU);
  preamble += static_cast<char>(header.size() >> 8U);
  return preamble + header;
}

void NpyRows::writeHeader() {
  const auto header = npyHeader(types_, rows_);
  if (header.size() > 0xFFFF) {
    failure_ = "the recording has too many channels for a NumPy file; export a .csv";
    return;
  }
  if (!output_->write(header)) failure_ = output_->failure();
}

void NpyRows::enter(const messages::Descriptor& descriptor) {
  scales_.clear();
  for (const auto& channel : descriptor.channels) scales_.emplace_back(channel.scale);
}

void NpyRows::row(const link::DecodedBlock& block, std::size_t k, SampleIndex sample) {
  const auto& channels = block.descriptor.channels;
  row_.clear();
  put(sample.index);
  put(toNs(codec::timeOf(block.header, sample)));
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const std::int64_t count = block.column(c)[k];
    if (channels[c].scale != 1.0) {
      put(scales_[c].value(count));
      continue;
    }
    const auto bits = std::bit_cast<std::uint64_t>(count);
    for (unsigned byte = 0; byte < channels[c].bytes; ++byte) row_ += static_cast<char>(bits >> (8 * byte));
  }
  put(block.descriptor.delay.result_id);
  for (const auto tau : block.descriptor.delay.tau_s) put(tau);
  if (job_.points != nullptr) {
    for (const double value : valuesOf(job_.points->of(block, k))) put(value);
  }
  if (!failure_ && !output_->write(row_)) failure_ = output_->failure();
  ++rows_;
}

void NpyRows::end() {
  if (failure_) return;
  output_->stream().seekp(0);
  writeHeader();
  if (!failure_ && !output_->finish()) failure_ = output_->failure();
}

}  // namespace probebox::command
