#include <cstdio>

#include "firmware/metrology/dataset/quantity.hpp"
#include "tools/case/readable.hpp"
#include "tools/tour/tour.hpp"

namespace probebox::tour {
namespace {

namespace quantity = metrology::quantity;

using namespace std::chrono_literals;

// Follows the run to its end, a line a touch.
Outcome<messages::ProcedureStatus::Answer> follow(link::Client& client, std::uint32_t run) {
  std::uint32_t shown = ~0U;
  while (true) {
    auto status = client.request<messages::ProcedureStatus>({}, link::patience(5s));
    if (!status) return Error{status.error().what};
    if (status->run == run && status->state > RunState::solving) return std::move(*status);
    if (status->run == run && status->step != shown && status->step < status->steps) {
      shown = status->step;
      std::printf("   %s\n", status->prompt.c_str());
      std::fflush(stdout);
    }
    if (!linger(client, 50ms)) return Error{"The link to the box is lost."};
  }
}

Outcome<messages::ResultSummary> resultOf(link::Client& client, std::uint64_t id) {
  const auto list = client.request<messages::ListResults>({.after_id = id - 1}, link::patience(5s));
  if (!list) return Error{list.error().what};
  for (const auto& result : list->results) {
    if (result.id == id) return result;
  }
  return Error{"The box does not list its result " + std::to_string(id) + "."};
}

const messages::NamedValue* valueOf(const messages::ResultSummary& result, std::string_view key) {
  for (const auto& value : result.values) {
    if (value.key == key) return &value;
  }
  return nullptr;
}

// Runs a method to its end. The result is proposed, not in force.
Outcome<messages::ResultSummary> measure(link::Client& client, const messages::StartProcedure::Request& method) {
  const auto started = client.request<messages::StartProcedure>(method, link::patience(5s));
  if (!started) return Error{started.error().what};
  TRY(const auto end, follow(client, started->run));
  if (end.state != RunState::proposed) return Error{"The calibration was refused: " + end.refusal};
  return resultOf(client, end.result_id);
}

}  // namespace

Stopped showCalibration(Stage& stage) {
  std::puts(
      "\n2. The system delay: the emulated controller touches the datum sphere, five points at each of five speeds.");
  TRY(auto client, meet(stage.box, nullptr));
  TRY(const auto result, measure(*client, {.method = "delay-multi-speed"}));
  const auto* tau = valueOf(result, quantity::kTau.key);
  const auto* diameter = valueOf(result, quantity::kEffectiveDiameter.key);
  if (tau == nullptr || diameter == nullptr) return Error{"The result names neither tau_s nor effective_diameter_mm."};
  const auto found = casefolder::withUncertainty(casefolder::labelOf(tau->key), tau->value, tau->uncertainty());
  std::printf("   tau = %s (truth %.1f us); accepted, hence in force.\n", found.c_str(), stage.truth.tau_s * 1e6);
  stage.table.estimate("system delay", *tau, stage.truth.tau_s);
  stage.table.estimate("sphere with stylus ball", *diameter, stage.truth.effective_diameter_mm);
  const auto accepted =
      client->request<messages::AcceptResult>({.id = result.id, .by = "tools/demo"}, link::patience(5s));
  if (!accepted) return Error{accepted.error().what};
  linger(*client, 300ms);
  return {};
}

Stopped showCentreline(Stage& stage) {
  std::puts(
      "\n3. The axis that turns the part: a ball on its spindle is touched at three angles, with the delay taken out.");
  TRY(auto client, meet(stage.box, nullptr));
  TRY(const auto result,
      measure(*client, {.method = "centreline", .options = {.speed_count = 1, .speeds_mm_s = {25}, .angles = 3}}));
  for (const std::size_t i : {0U, 1U}) {
    const auto* centre = valueOf(result, std::string{quantity::kCentre.key} + "[" + std::to_string(i) + "]");
    if (centre == nullptr) return Error{"The result does not name centre_mm."};
    stage.table.estimate(i == 0 ? "centreline X" : "centreline Y", *centre, stage.truth.centre_mm[i]);
    std::printf("   %s = %.6f +/- %.6f mm (truth %.6f)\n", i == 0 ? "X" : "Y", centre->value,
                centre->uncertainty().value_or(0), stage.truth.centre_mm[i]);
  }
  return {};
}

}  // namespace probebox::tour
