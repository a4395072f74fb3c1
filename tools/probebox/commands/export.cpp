#include <array>
#include <charconv>
#include <optional>
#include <vector>

#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/tables/csv_rows.hpp"
#include "tools/probebox/tables/mcap_rows.hpp"
#include "tools/probebox/tables/npy_rows.hpp"
#include "tools/probebox/tables/scale.hpp"
#include "tools/probebox/tables/table_of_recording.hpp"
#include "tools/probebox/tables/tip_points.hpp"

namespace probebox::command {
namespace {

constexpr double kUsualFriction = 0.2;  // of a ruby ball on steel, at most

// Sample, its time, the channels in their units, and the delay in force.
class ScaledRows : public CsvRows {
 public:
  using CsvRows::CsvRows;

 private:
  std::string header(const messages::Descriptor& descriptor) override {
    std::string text = "sample,time_ns";
    for (const auto& channel : descriptor.channels) text += "," + csvName(columnName(channel));
    text += ",delay_result_id,tau_x_s,tau_y_s,tau_z_s";
    if (job().points != nullptr)
      for (const auto name : kPointColumns) text.append(",").append(name);
    return text + "\n";
  }

  void fill(std::string& line, const link::DecodedBlock& block, std::size_t k, SampleIndex sample) override {
    append(line, sample.index);
    line += ',';
    append(line, toNs(codec::timeOf(block.header, sample)));
    for (std::size_t channel = 0; channel < scales_.size(); ++channel) {
      line += ',';
      line += scales_[channel].text(block.column(channel)[k]);
    }
    line += delay_;
    if (job().points != nullptr)
      for (const double value : valuesOf(job().points->of(block, k))) add(line, value);
    line += '\n';
  }

  // To a nanometre; a value that is not known is an empty cell.
  static void add(std::string& line, double value) {
    constexpr int kDecimals = 6;
    line += ',';
    if (value != value) return;
    std::array<char, 64> digits{};
    line.append(
        digits.data(),
        std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::fixed, kDecimals).ptr);
  }

  void enter(const messages::Descriptor& descriptor) override {
    scales_.clear();
    for (const auto& channel : descriptor.channels) scales_.emplace_back(channel.scale);
    delay_ = ",";
    append(delay_, descriptor.delay.result_id);
    for (const auto tau : descriptor.delay.tau_s) {
      delay_ += ',';
      append(delay_, tau);
    }
  }

  std::vector<Scale> scales_;
  std::string delay_;
};

}  // namespace

ExitStatus run(const Export& options, const std::string& given, Console& console) {
  if (const auto objection = objectionToFormat(options.output, Format::table_or_log))
    return console.fail(usage(*objection));
  const auto recording = chooseRecording(options.input, given);
  if (!recording) return console.fail(recording.error());
  if (options.friction && !options.points) return console.fail(usage("--friction is about --points: give both"));
  std::optional<TipPoints> points;
  if (options.points) points.emplace(options.friction.value_or(kUsualFriction));
  const TableJob job{*recording, options.output, options.force, options.triggers, points ? &*points : nullptr};
  if (job.output.ends_with(".npy")) {
    NpyRows rows{job};
    return writeTable(job, rows, console);
  }
  if (job.output.ends_with(".mcap")) {
    McapRows rows{job, console.out()};
    return writeTable(job, rows, console);
  }
  ScaledRows rows{job, console.out()};
  return writeTable(job, rows, console);
}

}  // namespace probebox::command
