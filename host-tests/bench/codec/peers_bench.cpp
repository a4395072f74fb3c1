// Bytes a sample and time of general coders on the reference scan, beside `fast` on the same samples in the same run.
// `bench_peers [samples a batch]`
#include <FLAC/stream_encoder.h>
#include <algorithm>
#include <bit>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <lz4.h>
#include <memory>
#include <vector>
#include <zstd.h>

#include "host-tests/support/innovation.hpp"
#include "host-tests/support/scan_signal.hpp"
#include "protocol/codec/block.hpp"
#include "protocol/frame/bytes.hpp"

namespace {

using namespace probebox;
using support::ScanSignal;
using Bytes = std::vector<std::byte>;

constexpr std::size_t kSamples = 65'536;
constexpr int kRuns = 7;

// One frame's worth, column by column.
using Batch = std::vector<std::int64_t>;

std::vector<Batch> batches(const std::vector<std::int64_t>& columns, std::size_t samples) {
  std::vector<Batch> all;
  for (std::size_t at = 0; at + samples <= kSamples; at += samples) {
    auto& batch = all.emplace_back();
    for (std::size_t c = 0; c < ScanSignal::kColumns; ++c)
      batch.insert(batch.end(), &columns[c * kSamples + at], &columns[c * kSamples + at + samples]);
  }
  return all;
}

using Column = std::span<std::int64_t>;

std::uint64_t zigzagged(std::int64_t step) {
  return frame::zigzag(static_cast<std::uint64_t>(step));
}

int bitsOf(Column column) {
  int bits = 0;
  for (const auto value : column) bits += static_cast<int>(std::bit_width(zigzagged(value)));
  return bits;
}

// The differences, of the first or second order, that have the fewest bits in that column; small whatever their sign.
Batch steps(const Batch& batch) {
  Batch found = batch;
  const std::size_t samples = batch.size() / ScanSignal::kColumns;
  for (std::size_t c = 0; c < ScanSignal::kColumns; ++c) {
    const Column column = std::span{found}.subspan(c * samples, samples);
    for (int order = 1; order <= 2; ++order) {
      std::vector<std::int64_t> next(column.begin(), column.end());
      for (std::size_t k = samples; k-- > 1;) next[k] -= next[k - 1];
      if (order == 1 || bitsOf(next) < bitsOf(column)) std::ranges::copy(next, column.begin());
    }
  }
  std::ranges::transform(found, found.begin(), [](std::int64_t v) { return static_cast<std::int64_t>(zigzagged(v)); });
  return found;
}

// The bytes of the same weight of one column side by side.
Bytes shuffled(const Batch& batch) {
  const std::size_t samples = batch.size() / ScanSignal::kColumns;
  Bytes bytes;
  for (std::size_t c = 0; c < ScanSignal::kColumns; ++c) {
    for (std::size_t weight = 0; weight < ScanSignal::kBytes.at(c); ++weight)
      for (std::size_t k = 0; k < samples; ++k)
        bytes.push_back(static_cast<std::byte>(static_cast<std::uint64_t>(batch[c * samples + k]) >> (8 * weight)));
  }
  return bytes;
}

std::size_t zstd(const Batch& batch, Bytes& into) {
  const Bytes plain = shuffled(steps(batch));
  return ZSTD_compress(into.data(), into.size(), plain.data(), plain.size(), 1);
}

std::size_t lz4(const Batch& batch, Bytes& into) {
  const Bytes plain = shuffled(steps(batch));
  return static_cast<std::size_t>(LZ4_compress_default(reinterpret_cast<const char*>(plain.data()),
                                                       reinterpret_cast<char*>(into.data()),
                                                       static_cast<int>(plain.size()), static_cast<int>(into.size())));
}

// A packed field of sint64 a column, as protobuf writes it: tag, length, zigzag varints.
std::size_t protobuf(const Batch& batch, Bytes& into) {
  const Batch values = steps(batch);
  const std::size_t samples = batch.size() / ScanSignal::kColumns;
  frame::ByteWriter writer{into};
  for (std::size_t c = 0; c < ScanSignal::kColumns; ++c) {
    std::size_t length = 0;
    for (std::size_t k = 0; k < samples; ++k)
      length += (std::bit_width(static_cast<std::uint64_t>(values[c * samples + k]) | 1U) + 6) / 7;
    writer.put(static_cast<std::uint8_t>((c + 1) << 3U | 2U));
    frame::putVarint(writer, length);
    for (std::size_t k = 0; k < samples; ++k)
      frame::putVarint(writer, static_cast<std::uint64_t>(values[c * samples + k]));
  }
  return writer.size();
}

// A stream a column, level 8, blocks of one batch. Its headers are not counted.
double flacBytesPerSample(const std::vector<std::int64_t>& columns, std::size_t samples) {
  std::size_t bytes = 0;
  const auto count = [](const FLAC__StreamEncoder*, const FLAC__byte*, std::size_t size, std::uint32_t in_block,
                        std::uint32_t, void* sum) {
    if (in_block > 0) *static_cast<std::size_t*>(sum) += size;
    return FLAC__STREAM_ENCODER_WRITE_STATUS_OK;
  };
  for (std::size_t c = 0; c < ScanSignal::kColumns; ++c) {
    const std::unique_ptr<FLAC__StreamEncoder, decltype(&FLAC__stream_encoder_delete)> encoder{
        FLAC__stream_encoder_new(), &FLAC__stream_encoder_delete};
    FLAC__stream_encoder_set_channels(encoder.get(), 1);
    FLAC__stream_encoder_set_bits_per_sample(encoder.get(), 32);
    FLAC__stream_encoder_set_streamable_subset(encoder.get(), 0);
    FLAC__stream_encoder_set_compression_level(encoder.get(), 8);
    FLAC__stream_encoder_set_blocksize(encoder.get(), static_cast<std::uint32_t>(samples));
    std::vector<FLAC__int32> values(kSamples);
    for (std::size_t k = 0; k < kSamples; ++k) values[k] = static_cast<FLAC__int32>(columns[c * kSamples + k]);
    if (FLAC__stream_encoder_init_stream(encoder.get(), count, nullptr, nullptr, nullptr, &bytes) !=
            FLAC__STREAM_ENCODER_INIT_STATUS_OK ||
        !FLAC__stream_encoder_process_interleaved(encoder.get(), values.data(), kSamples) ||
        !FLAC__stream_encoder_finish(encoder.get()))
      std::abort();
  }
  return static_cast<double>(bytes) / kSamples;
}

void show(const char* name, double bytes, double entropy_bytes, const std::function<void()>& run) {
  double best_s = 1e9;
  for (int k = 0; k < kRuns; ++k) {
    const auto begin = std::chrono::steady_clock::now();
    run();
    best_s = std::min(best_s, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  std::printf("%-28s %6.2f B/sample  %5.2f x entropy   encode %6.2f Ms/s\n", name, bytes, bytes / entropy_bytes,
              1e-6 * kSamples / best_s);
}

}  // namespace

int main(int count, char** words) {
  const std::size_t samples = count > 1 ? std::strtoul(words[1], nullptr, 10) : 256;
  const auto columns = ScanSignal{}.columns(kSamples, 1);
  double entropy_bytes = 0;
  for (std::size_t c = 0; c < ScanSignal::kColumns; ++c)
    entropy_bytes += support::innovationBits(std::span{columns}.subspan(c * kSamples, 16'384)) / 8;
  const auto all = batches(columns, samples);
  Bytes into(2 * samples * ScanSignal::kRecordBytes + 4096);

  std::vector<codec::ChannelFormat> formats;
  for (const auto bytes : ScanSignal::kBytes) formats.push_back({bytes, bytes != 2});
  const auto fast = [&](const Batch& batch, Bytes& to) {
    return *codec::encodeFast({.count = static_cast<std::uint16_t>(samples)}, formats, batch, to, codec::kernels());
  };
  const auto measured = [&](const char* name, const std::function<std::size_t(const Batch&, Bytes&)>& encode) {
    std::size_t bytes = 0;
    for (const auto& batch : all) bytes += encode(batch, into);
    show(name, static_cast<double>(bytes) / static_cast<double>(all.size() * samples), entropy_bytes, [&] {
      for (const auto& batch : all) encode(batch, into);
    });
  };
  std::printf("batches of %zu samples, entropy %.2f B/sample\n", samples, entropy_bytes);
  measured("fast, ours", fast);
  measured("protobuf, packed sint64", protobuf);
  measured("lz4 -1, shuffled steps", lz4);
  measured("zstd -1, shuffled steps", zstd);
  double flac = 0;
  const auto code = [&] { flac = flacBytesPerSample(columns, samples); };
  code();
  show("FLAC -8, a stream a column", flac, entropy_bytes, code);
}
