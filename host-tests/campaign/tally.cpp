#include "host-tests/campaign/tally.hpp"

#include <exception>
#include <nlohmann/json.hpp>

namespace probebox::campaign {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Tally, plays, restarts, reads, valid_reads, samples, lost_samples, solved, proposed,
                                   accepted, rolled_back, checks_of_values, acts, hours)

Tally& Tally::operator+=(const Tally& other) {
  plays += other.plays;
  restarts += other.restarts;
  reads += other.reads;
  valid_reads += other.valid_reads;
  samples += other.samples;
  lost_samples += other.lost_samples;
  solved += other.solved;
  proposed += other.proposed;
  accepted += other.accepted;
  rolled_back += other.rolled_back;
  checks_of_values += other.checks_of_values;
  for (std::size_t i = 0; i < kKinds; ++i) acts.at(i) += other.acts.at(i);
  hours += other.hours;
  return *this;
}

std::string toJson(const Verdict& verdict) {
  nlohmann::json json{{"tally", verdict.tally}};
  if (verdict.violation)
    json["violation"] = {{"at_ns", verdict.violation->at.count()}, {"what", verdict.violation->what}};
  return json.dump();
}

Outcome<Verdict> verdictFrom(std::string_view json) {
  try {
    const auto read = nlohmann::json::parse(json);
    Verdict verdict{.violation = std::nullopt, .tally = read.at("tally")};
    if (read.contains("violation")) {
      const auto& violation = read.at("violation");
      verdict.violation =
          Violation{.at = Nanoseconds{violation.at("at_ns").get<std::int64_t>()}, .what = violation.at("what")};
    }
    return verdict;
  } catch (const std::exception& problem) {
    return Error{problem.what()};
  }
}

}  // namespace probebox::campaign
