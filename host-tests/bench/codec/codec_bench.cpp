// Bytes a sample on the wire, as a session sends them, and time of every profile, with every processor's inner loops,
// beside memcpy of the raw record in the same run: absolute times of different machines do not compare. `bench_codec
// [samples a frame]...`
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "host-tests/support/innovation.hpp"
#include "host-tests/support/scan_signal.hpp"
#include "protocol/codec/block.hpp"
#include "protocol/codec/kernels.hpp"
#include "protocol/codec/tight.hpp"
#include "protocol/compact/compact.hpp"
#include "protocol/frame/frame.hpp"

namespace {

using namespace probebox;
using support::ScanSignal;

constexpr std::size_t kSamples = 65'536;
constexpr int kRuns = 31;
constexpr int kTightRuns = 3;  // it is a hundred times slower

std::vector<codec::ChannelFormat> formats() {
  std::vector<codec::ChannelFormat> all;
  for (const auto bytes : ScanSignal::kBytes) all.push_back({bytes, bytes != 2});
  return all;
}

// One frame's worth.
struct Batch {
  codec::BlockHeader header;
  std::vector<std::int64_t> columns;
  std::vector<std::byte> block;
  std::size_t bytes{};  // of it, when coded
};

std::vector<Batch> batches(const std::vector<std::int64_t>& columns, std::size_t samples) {
  std::vector<Batch> all;
  for (std::size_t at = 0; at + samples <= kSamples; at += samples) {
    auto& batch = all.emplace_back();
    batch.header = {.first = {static_cast<std::int64_t>(at)}, .count = static_cast<std::uint16_t>(samples)};
    for (std::size_t c = 0; c < ScanSignal::kColumns; ++c) {
      const auto* from = &columns[c * kSamples + at];
      batch.columns.insert(batch.columns.end(), from, from + samples);
    }
    batch.block.resize(codec::rawBlockSize(formats(), samples));
  }
  return all;
}

// Samples a second of the best of some runs: what else the machine does only makes a run slower.
double perSecond(std::size_t samples, int runs, const std::function<void()>& run) {
  double best = 1e9;
  for (int k = 0; k < runs; ++k) {
    const auto begin = std::chrono::steady_clock::now();
    run();
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  return static_cast<double>(samples) / best;
}

// Of more than caches hold, as recordings are.
double copying() {
  constexpr std::size_t kCopied = std::size_t{1} << 20U;
  const std::vector<std::byte> raw(kCopied * ScanSignal::kRecordBytes, std::byte{1});
  std::vector<std::byte> into(raw.size());
  return perSecond(kCopied, kRuns, [&] {
    std::memcpy(into.data(), raw.data(), raw.size());
    asm volatile("" : : "r"(into.data()) : "memory");
  });
}

using Encode = std::function<Outcome<std::size_t, codec::CodecError>(const Batch&, std::span<std::byte>)>;
using Decode = std::function<Outcome<codec::BlockSummary, codec::CodecError>(const Batch&, std::span<std::int64_t>)>;

// Bytes of the frames that a session makes of blocks, one after the other: those that can be shortened are.
std::size_t bytesOnWire(const std::vector<Batch>& all, double rate_hz) {
  constexpr std::uint32_t kDescriptor = 1;
  std::vector<std::byte> scratch(1U << 20U), coded(1U << 20U);
  compact::Shortener shortener{frame::kMaxPayload};
  std::size_t wire = 0;
  const auto send = [&](std::span<const std::byte> payload) {
    wire += frame::encodeDelimited({}, payload, scratch, coded);
  };
  for (const auto& batch : all) {
    const auto now = monoTime(std::llround(1e9 * static_cast<double>(batch.header.first.index) / rate_hz));
    const bool is_tight = static_cast<codec::Profile>(batch.block[0]) >= codec::Profile::tight;
    send(is_tight ? std::span<const std::byte>{batch.block} : shortener.samples(batch.block, kDescriptor, now).bytes);
    if (const auto head = shortener.headDue(kDescriptor); !head.empty()) send(head);
  }
  return wire;
}

void measure(const char* name, std::vector<Batch> all, double rate_hz, int runs, const Encode& encode,
             const Decode& decode, double entropy_bytes, double copies) {
  const std::size_t samples = all.size() * all.front().header.count;
  const double encoding = perSecond(samples, runs, [&] {
    for (auto& batch : all) batch.bytes = *encode(batch, batch.block);
  });
  for (auto& batch : all) batch.block.resize(batch.bytes);
  std::vector<std::int64_t> back(all.front().columns.size());
  for (const auto& batch : all) {
    if (!decode(batch, back).ok() || back != batch.columns) std::abort();
  }
  const double decoding = perSecond(samples, runs, [&] {
    for (const auto& batch : all) {
      if (!decode(batch, back).ok()) std::abort();
    }
  });
  const double bytes = static_cast<double>(bytesOnWire(all, rate_hz)) / static_cast<double>(samples);
  std::printf(
      "%-16s %5u  %6.2f B/sample  %5.2f x entropy   encode %6.1f Ms/s %5.2f x memcpy   decode %6.1f Ms/s %5.2f x "
      "memcpy\n",
      name, static_cast<unsigned>(all.front().header.count), bytes, bytes / entropy_bytes, encoding * 1e-6,
      encoding / copies, decoding * 1e-6, decoding / copies);
}

void measureAll(const ScanSignal& scan, const std::vector<std::size_t>& sizes, double copies) {
  const auto columns = scan.columns(kSamples, 1);
  std::printf("scan at %.0f Hz", scan.rate_hz);
  double bits = 0;
  for (std::size_t c = 0; c < ScanSignal::kColumns; ++c) {
    const double of_column = support::innovationBits(std::span{columns}.subspan(c * kSamples, 16'384));
    std::printf("%s%.2f", c == 0 ? ", innovation, bits: " : " + ", of_column);
    bits += of_column;
  }
  std::printf(" = %.2f B/sample\n", bits / 8);
  const auto channels = formats();
  const auto decodeWith = [&](const codec::Kernels& kernels) {
    return [&](const Batch& batch, std::span<std::int64_t> into) {
      return codec::decode(batch.block, channels, into, kernels);
    };
  };
  for (const auto samples : sizes) {
    const auto all = batches(columns, samples);
    measure(
        "raw", all, scan.rate_hz, kRuns,
        [&](const Batch& batch, std::span<std::byte> into) {
          return codec::encodeRaw(batch.header, channels, batch.columns, into);
        },
        decodeWith(codec::kernels()), bits / 8, copies);
    for (const auto& [name, kernels] : codec::allKernels()) {
      measure((std::string{"fast, "} + name).c_str(), all, scan.rate_hz, kRuns,
              [&](const Batch& batch, std::span<std::byte> into) {
                return codec::encodeFast(batch.header, channels, batch.columns, into, *kernels);
              },
              decodeWith(*kernels), bits / 8, copies);
    }
    codec::TightEncoder encoder{channels};
    codec::Decoder decoder;
    measure(
        "tight", all, scan.rate_hz, kTightRuns,
        [&](const Batch& batch, std::span<std::byte> into) {
          if (batch.header.first == SampleIndex{}) encoder.restart();
          return encoder.encode(batch.header, batch.columns, into);
        },
        [&](const Batch& batch, std::span<std::int64_t> into) { return decoder.decode(batch.block, channels, into); },
        bits / 8, copies);
  }
}

}  // namespace

int main(int count, char** words) {
  std::vector<std::size_t> sizes;
  for (int k = 1; k < count; ++k) sizes.push_back(std::strtoul(words[k], nullptr, 10));
  if (sizes.empty()) sizes = {64, 256};
  const double copies = copying();
  std::printf("memcpy of the raw record: %.1f Ms/s\n", copies * 1e-6);
  for (const double rate_hz : {4000.0, 1000.0, 10'000.0}) {
    ScanSignal scan;
    scan.rate_hz = rate_hz;
    measureAll(scan, sizes, copies);
  }
}
