#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "firmware/metrology/centreline/check_quantities.hpp"
#include "firmware/metrology/centreline/periodic_check.hpp"
#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/verdict.hpp"

namespace probebox::metrology {
namespace {

// The value compared, and its (|error| + U) / limit: above 1, conformity is not proven.
struct Judged {
  Proof proof{};
  double ratio{};
};
using Worst = std::optional<Judged>;

void worsen(Worst& worst, const Worst& by) {
  const Judged before = worst.value_or(Judged{});
  if (by) worst = {std::max(before.proof, by->proof), std::max(before.ratio, by->ratio)};
}

// Compares one value with the accepted one; nothing when no limit is stated.
Outcome<Worst, Refusal> judge(const Dataset& dataset, const Estimate& estimate, bool error, Result& result) {
  TRY(const auto accepted, configNumber(dataset, "accepted_" + estimate.key));
  TRY(const auto sd_accepted, configPositive(dataset, "sd_accepted_" + estimate.key));
  TRY(const auto limit, limitOf(dataset, estimate.key));
  if (!limit || (!accepted && !error)) return Worst{};
  Estimate deviation = estimate;
  deviation.key = "deviation_" + estimate.key;
  deviation.values = {estimate.value() - accepted.value_or(0.0)};
  deviation.design.clear();
  for (auto* part : {&deviation.sd, &deviation.uncertainty}) {
    if (!part->empty()) part->front() = std::hypot(part->front(), sd_accepted.value_or(0.0));
  }
  const auto& uncertainty = deviation.uncertainty.empty() ? deviation.sd : deviation.uncertainty;
  const double doubt = uncertainty.empty() ? 0.0 : 2.0 * uncertainty.front();
  const double off = std::abs(deviation.value());
  const Proof proof = proofOf(deviation.value(), doubt, *limit);
  if (proof != Proof::conforms) {
    const bool fails = proof == Proof::fails;
    result.warnings.push_back(std::string{fails ? kFailWarning : kNotProvenWarning} + estimate.key + " is " +
                              text(deviation.value()) + " mm off the accepted value, " + (fails ? "beyond" : "and") +
                              " the limit of " + text(*limit) + " mm " +
                              (fails ? "by more than U (k = 2): calibrate again"
                                     : "lies within U (k = 2), " + text(doubt) + " mm: measure more exactly"));
  }
  result.also.push_back(std::move(deviation));
  return Worst{{proof, (off + doubt) / *limit}};
}

// The worst verdict on the run-outs that a value was accepted of.
Outcome<Worst, Refusal> judgeRunOuts(const Dataset& dataset, Result& result) {
  Worst worst;
  for (const auto key : kCheckRunOuts) {
    if (!result.find(key) || !dataset.config.contains("accepted_" + std::string{key})) continue;
    const Estimate estimate = *result.find(key);
    TRY(const auto judged, judge(dataset, estimate, false, result));
    worsen(worst, judged);
  }
  if (worst && worst->proof == Proof::fails) {
    result.warnings.emplace_back(
        "the ball or the stylus has moved since it was calibrated: make a full calibration before this check counts");
  }
  return worst;
}

}  // namespace

Outcome<std::optional<double>, Refusal> limitOf(const Dataset& dataset, std::string_view key) {
  TRY(const auto own, configPositive(dataset, "limit_" + std::string{key}));
  return own ? own : configPositive(dataset, "limit_mm");
}

std::optional<Refusal> judgePeriodicCheck(const Dataset& dataset, Result& result) {
  TRY(const auto run_outs, judgeRunOuts(dataset, result));
  Worst worst = run_outs;
  for (const CheckQuantity* quantity : kCheckQuantities) {
    if (!result.find(quantity->key)) continue;
    const Estimate estimate = *result.find(quantity->key);
    TRY(const auto judged, judge(dataset, estimate, quantity->table != "centres", result));
    worsen(worst, judged);
  }
  if (!worst) return std::nullopt;
  result.also.push_back(Estimate::scalar(std::string{kVerdict}, static_cast<double>(worst->proof), std::nullopt));
  result.also.push_back(Estimate::scalar("worst_ratio", worst->ratio, std::nullopt));
  return std::nullopt;
}

}  // namespace probebox::metrology
