#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/probebox/cli/output.hpp"
#include "tools/probebox/tables/row_writer.hpp"
#include "tools/probebox/tables/scale.hpp"

namespace probebox::command {

// Writes an MCAP file (https://mcap.dev/spec, version 0): uncompressed chunks with an index. Own code, since Debian
// packages no library for it. The output may be a pipe: nothing is rewritten afterwards.
class McapFile {
 public:
  using Id = std::uint16_t;

  // `output` outlives the file.
  explicit McapFile(Output& output);

  // Adds a schema. definition: fields of a ROS 2 message, "int64 sample\nfloat64 x_mm\n".
  Id schema(std::string_view name, std::string_view definition);
  // Adds a channel; its messages are encoded as CDR, little endian.
  Id channel(std::string_view topic, Id schema);
  void message(Id channel, std::uint64_t time_ns, std::string_view data);
  // Adds named values that describe the whole file.
  void metadata(std::string_view name, const std::vector<std::pair<std::string, std::string>>& entries);
  void finish();

  // False after a failed write; Output::failure() says why.
  bool ok() const { return ok_; }

 private:
  struct ChunkIndex {
    std::uint64_t first_ns{}, last_ns{}, begin{}, length{}, index_length{}, size{};
    std::map<Id, std::uint64_t> message_indices;
  };
  struct MetadataIndex {
    std::uint64_t begin{}, length{};
    std::string name;
  };

  void write(std::string_view bytes);
  void endChunk();
  std::string statistics() const;
  void summarize();

  Output& output_;
  bool ok_{true};
  std::uint64_t position_{};
  std::string definitions_;  // schemas and channels, which the summary repeats
  std::string chunk_;
  std::uint64_t chunk_first_ns_{}, chunk_last_ns_{};
  std::map<Id, std::string> message_index_;  // of the chunk: time and place of each message
  std::vector<ChunkIndex> chunks_;
  std::vector<MetadataIndex> metadata_;
  std::map<Id, std::uint64_t> counts_;
  std::uint64_t first_ns_{}, last_ns_{};
  Id schemas_{}, channels_{};
};

// CRC-32 as in zlib and Ethernet, which MCAP asks for.
std::uint32_t crc32(std::string_view bytes);

// Encodes one message as CDR, little endian: each number is aligned to its size, counted from the end of the 4-byte
// header.
class CdrMessage {
 public:
  CdrMessage() : bytes_{std::string_view{"\0\1\0\0", 4}} {}
  CdrMessage& add(double value);
  CdrMessage& add(std::int64_t value);
  CdrMessage& add(std::uint8_t value);
  CdrMessage& add(std::string_view text);
  const std::string& bytes() const { return bytes_; }

 private:
  void align(std::size_t size);

  std::string bytes_;
};

// Writes a recording as MCAP, for Foxglove and PlotJuggler. Topics: /probebox/samples (one message per sample, channels
// as float64 in their units), /probebox/gaps (missing samples, with the reason), /probebox/triggers, /probebox/delay
// (in force from there on), and /probebox/points (samples whose tip is known) if they are wanted. Times: ns, monotonic
// since the boot of the box. The metadata "probebox" names the box.
class McapRows : public RowWriter {
 public:
  McapRows(const TableJob& job, std::ostream& standard) : job_{job}, standard_{standard} {}

  void begin(const messages::Descriptor& descriptor) override;
  void enter(const messages::Descriptor& descriptor) override;
  void row(const link::DecodedBlock& block, std::size_t k, SampleIndex sample) override;
  void missing(SampleIndex first, std::uint64_t count, std::string_view reason) override;
  void trigger(const messages::Trigger& trigger) override;
  bool holdsTriggers() const override { return true; }
  void end() override;
  const std::optional<std::string>& failure() const override { return failure_; }

 private:
  void declare(const messages::Descriptor& descriptor);
  void tellDelay(const messages::DelayInForce& delay, std::uint64_t time_ns);
  void tellPoint(const link::DecodedBlock& block, std::size_t k, SampleIndex sample);
  void put(McapFile::Id channel, std::uint64_t time_ns, const CdrMessage& message);

  const TableJob& job_;
  std::ostream& standard_;
  std::optional<Output> output_;
  std::optional<McapFile> file_;
  std::optional<std::string> failure_;
  std::vector<Scale> scales_;
  std::optional<std::uint64_t> delay_told_;  // number of the result
  McapFile::Id samples_{}, gaps_{}, triggers_{}, delays_{}, points_{};
  std::uint64_t newest_ns_{};
};

}  // namespace probebox::command
