// Bytes a sample on the wire and time of every profile, with every processor's inner loops, beside memcpy of the raw
// record in the same run: absolute times of different machines do not compare. `bench_codec [samples a frame]...`
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "entropy.hpp"
#include "host-tests/support/scan_signal.hpp"
#include "protocol/codec/block.hpp"
#include "protocol/codec/kernels.hpp"
#include "protocol/frame/frame.hpp"

namespace {

using namespace probebox;
using support::ScanSignal;

constexpr std::size_t kSamples = 65'536;
constexpr int kRuns = 31;

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
double perSecond(std::size_t samples, const std::function<void()>& run) {
  double best = 1e9;
  for (int k = 0; k < kRuns; ++k) {
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
  return perSecond(kCopied, [&] {
    std::memcpy(into.data(), raw.data(), raw.size());
    asm volatile("" : : "r"(into.data()) : "memory");
  });
}

using Encode = std::function<Outcome<std::size_t, codec::CodecError>(const Batch&, std::span<std::byte>)>;

void measure(const char* name, std::vector<Batch> all, const Encode& encode, const codec::Kernels& kernels,
             double entropy_bytes, double copies) {
  const auto channels = formats();
  const std::size_t samples = all.size() * all.front().header.count;
  std::size_t wire = 0;
  std::vector<std::byte> scratch(1U << 20U), coded(1U << 20U);
  const double encoding = perSecond(samples, [&] {
    for (auto& batch : all) batch.bytes = *encode(batch, batch.block);
  });
  for (auto& batch : all) batch.block.resize(batch.bytes);
  std::vector<std::int64_t> back(all.front().columns.size());
  for (const auto& batch : all) {
    wire += frame::encodeDelimited({}, batch.block, scratch, coded);
    if (!codec::decode(batch.block, channels, back, kernels).ok() || back != batch.columns) std::abort();
  }
  const double decoding = perSecond(samples, [&] {
    for (const auto& batch : all) {
      if (!codec::decode(batch.block, channels, back, kernels).ok()) std::abort();
    }
  });
  const double bytes = static_cast<double>(wire) / static_cast<double>(samples);
  std::printf(
      "%-16s %5u  %6.2f B/sample  %5.2f x entropy   encode %6.1f Ms/s %5.2f x memcpy   decode %6.1f Ms/s %5.2f x "
      "memcpy\n",
      name, static_cast<unsigned>(all.front().header.count), bytes, bytes / entropy_bytes, encoding * 1e-6,
      encoding / copies, decoding * 1e-6, decoding / copies);
}

}  // namespace

int main(int count, char** words) {
  const auto columns = ScanSignal{}.columns(kSamples, 1);
  double bits = 0;
  for (std::size_t c = 0; c < ScanSignal::kColumns; ++c) {
    const double of_column = bench::innovationBits(std::span{columns}.subspan(c * kSamples, 16'384));
    std::printf("%s%.2f", c == 0 ? "innovation, bits: " : " + ", of_column);
    bits += of_column;
  }
  const double copies = copying();
  std::printf(" = %.2f B/sample\nmemcpy of the raw record: %.1f Ms/s\n", bits / 8, copies * 1e-6);
  std::vector<std::size_t> sizes;
  for (int k = 1; k < count; ++k) sizes.push_back(std::strtoul(words[k], nullptr, 10));
  if (sizes.empty()) sizes = {64, 128, 256, 259};
  const auto channels = formats();
  for (const auto samples : sizes) {
    const auto all = batches(columns, samples);
    measure(
        "raw", all,
        [&](const Batch& batch, std::span<std::byte> into) {
          return codec::encodeRaw(batch.header, channels, batch.columns, into);
        },
        codec::kernels(), bits / 8, copies);
    for (const auto& [name, kernels] : codec::allKernels()) {
      measure((std::string{"fast, "} + name).c_str(), all,
              [&](const Batch& batch, std::span<std::byte> into) {
                return codec::encodeFast(batch.header, channels, batch.columns, into, *kernels);
              },
              *kernels, bits / 8, copies);
    }
  }
}
