#include <cstdio>

#include "tools/case/readable.hpp"
#include "tools/tour/tour.hpp"

namespace probebox::tour {
namespace {

using namespace std::chrono_literals;
using messages::ProcedureState;

// Follows the run to its end, a line a touch.
Outcome<messages::ProcedureStatus::Answer> follow(link::Client& client, std::uint32_t run) {
  std::uint32_t shown = ~0U;
  while (true) {
    auto status = client.request<messages::ProcedureStatus>({}, link::patience(5s));
    if (!status) return Error{status.error().what};
    if (status->run == run && status->state > ProcedureState::solving) return std::move(*status);
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

const messages::NamedValue* valueOf(const messages::ResultSummary& result, const std::string& key) {
  for (const auto& value : result.values) {
    if (value.key == key) return &value;
  }
  return nullptr;
}

}  // namespace

Stopped showCalibration(Stage& stage) {
  std::puts(
      "\n2. The system delay: the emulated controller touches the datum sphere, five points at each of five speeds.");
  auto client = meet(stage.box, nullptr);
  if (!client) return client.error();
  const auto started =
      (*client)->request<messages::StartProcedure>({.method = "delay-multi-speed"}, link::patience(5s));
  if (!started) return Error{started.error().what};
  const auto end = follow(**client, started->run);
  if (!end) return end.error();
  if (end->state != ProcedureState::proposed) return Error{"The calibration was refused: " + end->refusal};
  const auto result = resultOf(**client, end->result_id);
  if (!result) return result.error();
  const auto* tau = valueOf(*result, "tau_s");
  const auto* diameter = valueOf(*result, "effective_diameter_mm");
  if (tau == nullptr || diameter == nullptr) return Error{"The result names neither tau_s nor effective_diameter_mm."};
  const auto found = casefolder::withSd(casefolder::labelOf(tau->key), tau->value, tau->sd);
  std::printf("   tau = %s (truth %.1f us); accepted, hence in force.\n", found.c_str(), stage.truth.tau_s * 1e6);
  stage.table.estimate("system delay", *tau, stage.truth.tau_s);
  stage.table.estimate("sphere with stylus ball", *diameter, stage.truth.effective_diameter_mm);
  const auto accepted =
      (*client)->request<messages::AcceptResult>({.id = end->result_id, .by = "tools/demo"}, link::patience(5s));
  if (!accepted) return Error{accepted.error().what};
  linger(**client, 300ms);
  return {};
}

}  // namespace probebox::tour
