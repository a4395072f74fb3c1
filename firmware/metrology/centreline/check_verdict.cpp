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

// The value compared, and its (|error| + U) / limit: above 1, conformity is not proven. No ratio where U is unknown.
struct Judged {
  Proof proof{};
  std::optional<double> ratio{0.0};
};
using Worst = std::optional<Judged>;

void worsen(Worst& worst, const Worst& by) {
  if (!by) return;
  const Judged before = worst.value_or(Judged{});
  const bool known = before.ratio && by->ratio;
  worst = {std::max(before.proof, by->proof),
           known ? std::optional{std::max(*before.ratio, *by->ratio)} : std::nullopt};
}

bool hasOwnLimit(const Dataset& dataset, std::string_view key) {
  return dataset.config.contains("limit_" + std::string{key});
}

// A value with a limit of its own that is compared with nothing.
Worst notJudged(std::string_view key, const std::string& why, Result& result) {
  result.warnings.push_back(std::string{kNotProvenWarning} + std::string{key} + " has a limit and " + why);
  return Judged{Proof::not_proven, std::nullopt};
}

// What to say of a value that is not proven to be within its limit, or is beyond it.
std::string aboutProof(const Estimate& deviation, std::string_view key, Proof proof, std::optional<double> doubt,
                       double limit) {
  const bool fails = proof == Proof::fails;
  const std::string off = std::string{fails ? kFailWarning : kNotProvenWarning} + std::string{key} + " is " +
                          text(deviation.value()) + " mm off the accepted value, ";
  if (!doubt)
    return off + "and its U is unknown, by which it may be beyond the limit of " + text(limit) +
           " mm: state sigma_mm, or take more readings";
  return off + (fails ? "beyond" : "and") + " the limit of " + text(limit) + " mm " +
         (fails ? "by more than U (k = 2): calibrate again"
                : "lies within U (k = 2), " + text(*doubt) + " mm: measure more exactly");
}

// Compares one value with the accepted one; nothing when no limit is stated, or when limit_mm alone is and nothing was
// accepted.
Outcome<Worst, Refusal> judge(const Dataset& dataset, const Estimate& estimate, bool error, Result& result) {
  TRY(const auto accepted, configNumber(dataset, "accepted_" + estimate.key));
  TRY(const auto sd_accepted, configPositive(dataset, "sd_accepted_" + estimate.key));
  TRY(const auto limit, limitOf(dataset, estimate.key));
  if (!limit) return Worst{};
  if (!accepted && !error) {
    if (!hasOwnLimit(dataset, estimate.key)) return Worst{};
    return notJudged(estimate.key, "no accepted value: state accepted_" + estimate.key, result);
  }
  Estimate deviation = estimate;
  deviation.key = std::string{quantity::kDeviation.key} + estimate.key;
  deviation.values = {estimate.value() - accepted.value_or(0.0)};
  deviation.design.clear();
  for (auto* part : {&deviation.sd, &deviation.uncertainty}) {
    if (!part->empty()) part->front() = std::hypot(part->front(), sd_accepted.value_or(0.0));
  }
  const auto& uncertainty = deviation.uncertainty.empty() ? deviation.sd : deviation.uncertainty;
  const auto doubt = uncertainty.empty() ? std::nullopt : std::optional{2.0 * uncertainty.front()};
  const Proof proof = proofOf(deviation.value(), doubt, *limit);
  if (proof != Proof::conforms) result.warnings.push_back(aboutProof(deviation, estimate.key, proof, doubt, *limit));
  const auto ratio = doubt ? std::optional{(std::abs(deviation.value()) + *doubt) / *limit} : std::nullopt;
  result.also.push_back(std::move(deviation));
  return Worst{{proof, ratio}};
}

// The same of a key, which may not have been measured.
Outcome<Worst, Refusal> judgeKey(const Dataset& dataset, std::string_view key, bool error, Result& result) {
  const auto* found = result.find(key);
  if (found == nullptr)
    return hasOwnLimit(dataset, key)
               ? notJudged(key, "was not measured: measure it, or omit limit_" + std::string{key}, result)
               : Worst{};
  return judge(dataset, Estimate{*found}, error, result);
}

// The worst verdict on the run-outs that a value was accepted of.
Outcome<Worst, Refusal> judgeRunOuts(const Dataset& dataset, Result& result) {
  Worst worst;
  for (const auto key : kCheckRunOuts) {
    TRY(const auto judged, judgeKey(dataset, key, false, result));
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
    TRY(const auto judged, judgeKey(dataset, quantity->key, quantity->table != "centres", result));
    worsen(worst, judged);
  }
  if (!worst) return std::nullopt;
  result.also.push_back(Estimate::scalar(std::string{kVerdict}, static_cast<double>(worst->proof), std::nullopt));
  if (worst->ratio) result.also.push_back(Estimate::scalar(std::string{kWorstRatio}, *worst->ratio, std::nullopt));
  return std::nullopt;
}

}  // namespace probebox::metrology
