#pragma once
#include <array>
#include <charconv>
#include <optional>
#include <string>
#include <string_view>

#include "protocol/units/wording.hpp"
#include "tools/probebox/cli/output.hpp"
#include "tools/probebox/tables/row_writer.hpp"

namespace probebox::command {

inline void append(std::string& text, auto number) {
  std::array<char, 40> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  text.append(digits.data(), end);
}

// Makes the name of a column safe for a spreadsheet, which takes = + - @ at its beginning for a formula, and a comma,
// semicolon or quotation mark as CSV syntax.
inline std::string csvName(std::string_view name) {
  std::string all = shown(name);
  for (auto& c : all) {
    if (c == ',' || c == '"' || c == ';') c = '_';
  }
  const bool formula = !all.empty() && std::string_view{"=+-@"}.find(all.front()) != std::string_view::npos;
  return formula ? "'" + all : all;
}

// Writes rows as lines of text; derived classes fill them.
class CsvRows : public RowWriter {
 public:
  CsvRows(const TableJob& job, std::ostream& standard) : job_{job}, standard_{standard} {}

  void begin(const messages::Descriptor& descriptor) override {
    auto output = Output::open(job_.output, job_.force, standard_);
    if (!output) {
      failure_ = output.error().what;
      return;
    }
    output_.emplace(std::move(output).value());
    write(header(descriptor));
  }
  void row(const link::DecodedBlock& block, std::size_t k, SampleIndex sample) override {
    line_.clear();
    fill(line_, block, k, sample);
    write(line_);
  }
  void end() override {
    if (!failure_ && !output_->finish()) failure_ = output_->failure();
  }
  const std::optional<std::string>& failure() const override { return failure_; }

 protected:
  const TableJob& job() const { return job_; }

 private:
  // Both include the line feed.
  virtual std::string header(const messages::Descriptor& descriptor) = 0;
  virtual void fill(std::string& line, const link::DecodedBlock& block, std::size_t k, SampleIndex sample) = 0;

  void write(const std::string& text) {
    if (!failure_ && !output_->write(text)) failure_ = output_->failure();
  }

  const TableJob& job_;
  std::ostream& standard_;
  std::optional<Output> output_;
  std::optional<std::string> failure_;
  std::string line_;
};

}  // namespace probebox::command
