#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/probebox/cli/output.hpp"
#include "tools/probebox/tables/row_writer.hpp"
#include "tools/probebox/tables/scale.hpp"

namespace probebox::command {

// Returns the header of a structured array. types: the fields as numpy writes them, "('sample', '<i8'), ". Its length
// does not depend on the number of rows and is a multiple of 64; version 1.0 allows at most 64 kB.
std::string npyHeader(const std::string& types, std::uint64_t rows);

// Writes rows as a structured array of NumPy (.npy, format 1.0), which numpy.load() reads without pickle, little
// endian: sample and time_ns i8; channels with a scale of one count as integers of their width, others as f8 in their
// unit; then the delay in force: delay_result_id u8, tau_x_s, tau_y_s, tau_z_s f8; then the columns of a TipPoint, f8,
// if they are wanted. A channel with one of these names gets a _ appended. The number of rows is filled in at the end,
// so the output must be a file.
class NpyRows : public RowWriter {
 public:
  explicit NpyRows(const TableJob& job) : job_{job} {}

  void begin(const messages::Descriptor& descriptor) override;
  // Not when a channel would have another type.
  bool canGoOnWith(const messages::Descriptor& descriptor) const override { return typesOf(descriptor) == types_; }
  void enter(const messages::Descriptor& descriptor) override;
  void row(const link::DecodedBlock& block, std::size_t k, SampleIndex sample) override;
  void end() override;
  const std::optional<std::string>& failure() const override { return failure_; }

 private:
  std::string typesOf(const messages::Descriptor& descriptor) const;
  void writeHeader();
  template <class T>
  void put(T value);

  const TableJob& job_;
  std::optional<Output> output_;
  std::optional<std::string> failure_;
  std::string types_;  // of the fields, as numpy writes them
  std::vector<Scale> scales_;
  std::string row_;
  std::uint64_t rows_{};
};

}  // namespace probebox::command
