#pragma once
#include <array>
#include <charconv>
#include <optional>
#include <string>

#include "tools/probebox/cli/output.hpp"
#include "tools/probebox/tables/row_writer.hpp"

namespace probebox::command {

inline void append(std::string& text, auto number) {
  std::array<char, 40> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  text.append(digits.data(), end);
}

// Rows as lines of text. What stands in them is up to who derives.
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
    if (!failure_ && !output_->flush()) failure_ = output_->failure();
  }
  const std::optional<std::string>& failure() const override { return failure_; }

 private:
  // Each with the end of the line.
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
