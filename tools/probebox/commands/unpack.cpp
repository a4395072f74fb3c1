#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/tables/csv_rows.hpp"
#include "tools/probebox/tables/scale.hpp"
#include "tools/probebox/tables/table_of_recording.hpp"

namespace probebox::command {
namespace {

// Integers as they were recorded: counts where a channel has a scale.
class CountRows : public CsvRows {
 public:
  using CsvRows::CsvRows;

 private:
  std::string header(const messages::Descriptor& descriptor) override {
    std::string text = "sample";
    for (const auto& channel : descriptor.channels)
      text += "," + csvName(channel.scale == 1.0 ? columnName(channel) : channel.name + "_counts");
    return text + "\n";
  }

  void fill(std::string& line, const link::DecodedBlock& block, std::size_t k, SampleIndex sample) override {
    append(line, sample.index);
    for (std::size_t channel = 0; channel < block.descriptor.channels.size(); ++channel) {
      line += ',';
      append(line, block.column(channel)[k]);
    }
    line += '\n';
  }
};

}  // namespace

ExitStatus run(const Unpack& options, const std::string&, Console& console) {
  const TableJob job{options.input, options.output, options.force};
  CountRows rows{job, console.out()};
  return writeTable(job, rows, console);
}

}  // namespace probebox::command
