#include "fake_answers.hpp"

#include <cmath>

#include "firmware/json/dataset_json.hpp"
#include "firmware/json/result_json.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

using messages::ErrorCode;
using messages::Operation;
using Reply = FakeAnswers::Reply;

template <class Message>
Reply ok(const Message& message) {
  return {ErrorCode::ok, {}, messages::encoded(message)};
}

Reply no(ErrorCode code, std::string text) {
  return {code, std::move(text), {}};
}

template <class Message>
Message read(std::span<const std::byte> body) {
  const auto decoded = messages::decode<Message>(body);
  return decoded.ok() ? decoded.value() : Message{};
}

}  // namespace

messages::Descriptor fakeDescriptor() {
  messages::Descriptor d;
  d.board = "fake";
  d.serial_number = "F-0001";
  d.firmware_version = "0.1.0-fake";
  d.machine = "test mill";
  d.probe = "P-1001";
  d.channels = {{"deflection_a", "nm", 1.0, 4, true, "probe channel a"},
                {"x", "um", 0.001, 8, true, "axis X"},
                {"flags", "", 1.0, 2, false, "bits"}};
  d.gain = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  return d;
}

metrology::Dataset fakeDataset() {
  auto dataset = metrology::touchDataset("delay-multi-speed");
  dataset.config["sigma_mm"] = 0.0005;
  for (int i = 0; i < 2000; ++i) dataset.tables[0].append({0, i * 0.002, 1.0 / (i + 1), -20.0 / 3, 30});
  for (int i = 0; i < 2000; ++i) dataset.tables[1].append({0, i * 0.001, i * 1e-9, 0, 0.1});
  dataset.tables[2].append({0, 1, 0, 0, 1, 0, 0, 25});
  return dataset;
}

Reply FakeAnswers::answer(Operation operation, std::span<const std::byte> body) {
  if (options_.answers_first) {
    if (auto reply = options_.answers_first(operation, body)) return std::move(*reply);
  }
  switch (operation) {
    case Operation::status:
      return status();
    case Operation::start_procedure:
      return start();
    case Operation::procedure_status:
      return procedure();
    case Operation::post_marker:
      return mark(body);
    case Operation::abort_procedure:
      return abort(body);
    case Operation::list_results:
      return results(body);
    case Operation::accept_result:
      return accept(body);
    case Operation::rollback_result:
      return rollBack(body);
    case Operation::result_history:
      return history(body);
    case Operation::get_dataset:
      return dataset(body);
    case Operation::get_result:
      return kept(body);
    case Operation::loop_back:
      return loopBack();
    case Operation::corrections: {
      messages::Corrections::Answer answer;
      answer.valid = true;
      answer.correction_mm = {0.0012, -0.0034, 0};
      answer.mask = 8;
      answer.heartbeat = 17;
      answer.inhibited = options_.line_inhibits;
      return ok(answer);
    }
    default:
      return no(ErrorCode::unknown_operation, "the fake box knows no such operation");
  }
}

Reply FakeAnswers::status() const {
  messages::Status::Answer s;
  s.board = "fake";
  s.firmware_version = "0.1.0-fake";
  s.uptime_ms = 125'000;
  s.clock = {options_.unlocked ? ClockState::unlocked : ClockState::locked,
             850,
             -1200.0,
             Tick{125'000},
             {124'990, 8, 1, 1, 0}};
  s.ledger = {125'000, 150, 0};
  s.sources = {{"gpiochip0 line 4 (sync)", "", 5}, {"gpiochip0 line 6 (index X)", "held by 'spindle'; stop that", 0}};
  s.lines = {{"sync", 0, 0, 125'000, 3}, {"index X", 2, 0, 0, 0}};
  s.receiver = {ClockState::locked, 620, 41'000.0, 250'000, 12, 900, 0, 1, 0, 5};
  s.events = {700'000, 40, 30, 6, 0, 7, 8, 9, 11, 2};
  s.cnc_lines = {{"/dev/ttyS2", 500, 12, 13, 14, 15, 16}};
  s.usb_ports = {{"", 21, 22, 23, 24, 25}, {"/run/x is not there", 0, 0, 0, 0, 0}};
  s.procedure = running_ ? "running" : "";
  if (!accepted_by_.empty()) {
    s.active_results = {FakeBox::kResultId};
  } else if (options_.in_force_tau_s != 0) {
    s.active_results = {oneInForce().id};
  }
  return ok(s);
}

Reply FakeAnswers::loopBack() const {
  if (!options_.joined) return no(ErrorCode::not_found, "the fake box has no loop-back");
  return ok(messages::LoopBack::Answer{.output = "OUT",
                                       .input = "IN",
                                       .pulses = 500,
                                       .lost = options_.lost_pulses,
                                       .median_ns = 21'300,
                                       .p99_ns = 48'000,
                                       .largest_ns = 95'000,
                                       .bracket_ns = 4000,
                                       .sigma_ns = 2600});
}

Reply FakeAnswers::start() {
  if (options_.when_asked) options_.when_asked();
  if (options_.busy) return no(ErrorCode::busy, "run 6 is still going on; wait for its end, or abort it");
  running_ = true;
  asked_ = 0;
  proposed_ = false;
  return ok(messages::StartProcedure::Answer{7});
}

Reply FakeAnswers::abort(std::span<const std::byte> body) {
  const auto run = read<messages::AbortProcedure::Request>(body).run;
  if (run != 0 && run != presentRun()) return no(ErrorCode::wrong_state, "the box is at another run");
  running_ = false;
  return ok(messages::Nothing{});
}

Reply FakeAnswers::procedure() {
  if (options_.when_asked) options_.when_asked();
  messages::ProcedureStatus::Answer p;
  p.run = presentRun();
  p.method = "delay-multi-speed";
  p.steps = kSteps;
  p.step = std::min(asked_ / 2, kSteps);
  p.state = asked_ % 2 == 0 ? RunState::waiting : RunState::running;
  p.prompt = "touch " + std::to_string(p.step + 1) + " of 3: +X side of the sphere";
  if (p.step == kSteps) {
    p.state = RunState::solving;
    p.prompt = "";
  }
  const bool waits = options_.by_hand && asked_ < 2 * kSteps;
  if (!waits && asked_++ > 2 * kSteps) {
    p.state = options_.refuses_run ? RunState::refused : RunState::proposed;
    if (options_.refuses_run) p.refusal = "single-speed: all touches have one speed; measure at two or more";
    p.result_id = options_.refuses_run || options_.only_looks ? 0 : FakeBox::kResultId;
    proposed_ = !options_.refuses_run;
  }
  if (!running_) p.state = RunState::idle;
  return ok(p);
}

Reply FakeAnswers::mark(std::span<const std::byte> body) {
  const auto marker = read<messages::PostMarker::Request>(body);
  const auto expected = asked_ % 2 == 0 ? messages::StepPhase::begin : messages::StepPhase::end;
  if (marker.procedure != 7 || marker.step != asked_ / 2 || marker.phase != expected)
    return no(ErrorCode::wrong_state, "that is not the step that the run waits for");
  ++asked_;
  return ok(messages::Nothing{});
}

Reply FakeAnswers::results(std::span<const std::byte> body) const {
  constexpr std::size_t kMostInOne = 4;
  messages::ListResults::Answer list;
  if (options_.endless) return list.results.push_back({.id = 7}), list.more = true, ok(list);
  const auto after = read<messages::ListResults::Request>(body).after_id;
  for (auto id = after + 1; id <= options_.older_results; ++id) {
    if (list.results.size() == kMostInOne) return list.more = true, ok(list);
    list.results.push_back({.id = id, .state = messages::ResultState::retired, .method = "delay-multi-speed"});
  }
  if (options_.refused_before && after < refusedOne().id) list.results.push_back(refusedOne());
  if (options_.in_force_tau_s != 0 && after < oneInForce().id) list.results.push_back(oneInForce());
  if (proposed_ && after < FakeBox::kResultId) list.results.push_back(proposedOne());
  return ok(list);
}

messages::ResultSummary FakeAnswers::proposedOne() const {
  messages::ResultSummary r;
  r.id = FakeBox::kResultId;
  r.method = "delay-multi-speed";
  r.subject = "delay";
  r.state = accepted_by_.empty() ? messages::ResultState::proposed : messages::ResultState::active;
  r.accepted_by = accepted_by_;
  r.values = {{"tau_s", FakeBox::kTau_s, FakeBox::kSd_s, true, options_.u_s, options_.u_s > 0}};
  r.dof = 21;
  r.rests_on = {{.id = 4700, .subject = "stylus-offset-1", .retired = true}};
  r.as_this_machine_by = "Hopper";
  return r;
}

messages::ResultSummary FakeAnswers::oneInForce() const {
  auto r = proposedOne();
  r.id = FakeBox::kResultId - 1;
  r.state = messages::ResultState::active;
  r.accepted_by = "Grace";
  r.values[0].value = options_.in_force_tau_s;
  return r;
}

messages::ResultSummary FakeAnswers::refusedOne() const {
  auto r = proposedOne();
  r.id = FakeBox::kResultId - 2;
  r.state = messages::ResultState::refused;
  r.accepted_by.clear();
  r.values.clear();
  return r;
}

// Documents in pieces of 100 bytes; the dataset of the older one is no longer kept.
Reply FakeAnswers::kept(std::span<const std::byte> body) const {
  constexpr std::size_t kPiece = 100;
  const auto request = read<messages::GetResult::Request>(body);
  if (options_.refused_before && request.id == refusedOne().id) {
    const auto text = json::toJson(metrology::Refusal{"single-speed", "all touches have one speed"});
    return ok(messages::GetResult::Answer{
        .summary = refusedOne(), .dataset_kept = false, .total_bytes = text.size(), .offset = 0, .bytes = text});
  }
  const bool is_proposed = request.id == FakeBox::kResultId && proposed_;
  if (!is_proposed && (request.id != oneInForce().id || options_.in_force_tau_s == 0))
    return no(ErrorCode::not_found, "there is no such result");
  messages::GetResult::Answer answer;
  answer.summary = is_proposed ? proposedOne() : oneInForce();
  metrology::Result result;
  result.method = "delay-multi-speed";
  result.estimates = {metrology::Estimate::scalar("tau_s", answer.summary.values[0].value, FakeBox::kSd_s)};
  result.estimates[0].uncertainty = {2 * FakeBox::kSd_s};
  result.dof = 21;
  answer.summary.values.clear();
  answer.summary.rests_on.clear();
  answer.summary.as_this_machine_by.clear();
  answer.dataset_kept = is_proposed;
  std::string text = json::toJson(result);
  if (request.document == messages::ResultDocument::dataset) text = is_proposed ? json::toJson(fakeDataset()) : "";
  answer.total_bytes = text.size();
  answer.offset = std::min<std::uint64_t>(request.offset, text.size());
  answer.bytes = text.substr(answer.offset, request.document == messages::ResultDocument::dataset ? 8192 : kPiece);
  return ok(answer);
}

messages::AcceptResult::Answer FakeAnswers::compared() const {
  messages::AcceptResult::Answer answer{.state = messages::ResultState::proposed, .subject = "delay"};
  answer.first_of_subject = options_.in_force_tau_s == 0;
  if (answer.first_of_subject) return answer;
  answer.compared_with = oneInForce().id;
  answer.changes.push_back({.key = "tau_s",
                            .value = FakeBox::kTau_s,
                            .sd = FakeBox::kSd_s,
                            .has_sd = true,
                            .before = options_.in_force_tau_s,
                            .sd_before = FakeBox::kSd_s,
                            .has_sd_before = true});
  return answer;
}

Reply FakeAnswers::accept(std::span<const std::byte> body) {
  const auto request = read<messages::AcceptResult::Request>(body);
  if (options_.forbids_accepting) return no(ErrorCode::not_permitted, "accepting over a link is off; see service.toml");
  if (request.id != FakeBox::kResultId || !proposed_) return no(ErrorCode::not_found, "there is no such result");
  if (request.compare_only) return ok(compared());
  const double before_s = options_.in_force_tau_s;
  const double in_sd =
      before_s == 0 ? 0 : std::abs(FakeBox::kTau_s - before_s) / std::hypot(FakeBox::kSd_s, FakeBox::kSd_s);
  if (in_sd > 4 && !request.although_it_differs) {
    return no(ErrorCode::differs, printed("tau differs by %.1f sd; accept it with --although-it-differs", in_sd));
  }
  if (accepted_by_.empty()) accepted_by_ = request.by;
  messages::AcceptResult::Answer answer;
  answer.accepted_by = accepted_by_;
  if (options_.cut_is_on) answer.state = messages::ResultState::accepted, answer.waiting_for_cut = true;
  return ok(answer);
}

// Delay alone: 4711 goes, 4710 comes back.
Reply FakeAnswers::rollBack(std::span<const std::byte> body) const {
  const auto request = read<messages::RollbackResult::Request>(body);
  if (options_.cut_is_on) return no(ErrorCode::wrong_state, "a cut is on; repeat the rollback when it is over");
  if (request.id != FakeBox::kResultId && request.subject != "delay") {
    return no(ErrorCode::wrong_state, "no result about '" + request.subject + "' has ever been in force here");
  }
  return ok(messages::RollbackResult::Answer{"delay", FakeBox::kResultId, FakeBox::kResultId - 1, false});
}

// Two transitions of each of ten results, three in an answer.
Reply FakeAnswers::history(std::span<const std::byte> body) const {
  constexpr std::size_t kMostInOne = 3;
  const auto request = read<messages::ResultHistory::Request>(body);
  messages::ResultHistory::Answer answer;
  if (options_.endless) return answer.transitions.push_back({.number = 7}), answer.more = true, ok(answer);
  for (std::uint64_t number = request.after_number + 1; number <= 20; ++number) {
    const std::uint64_t id = (number + 1) / 2;
    if (request.id != 0 && request.id != id) continue;
    if (!request.subject.empty() && request.subject != "delay") continue;
    if (answer.transitions.size() == kMostInOne) return answer.more = true, ok(answer);
    const bool is_first = number % 2 == 1;
    answer.transitions.push_back({.number = number,
                                  .result_id = id,
                                  .method = "delay-multi-speed",
                                  .subject = "delay",
                                  .probe = "P-1",
                                  .machine = "mill",
                                  .mounting = "spindle",
                                  .state = is_first ? messages::ResultState::proposed : messages::ResultState::active,
                                  .utc = "2026-11-21T06:00:00Z",
                                  .by = is_first ? "" : "Ada"});
  }
  return ok(answer);
}

Reply FakeAnswers::dataset(std::span<const std::byte> body) const {
  constexpr std::size_t kPiece = 8192;
  const auto text = json::toJson(fakeDataset());
  const auto offset = std::min<std::size_t>(read<messages::GetDataset::Request>(body).offset, text.size());
  return ok(messages::GetDataset::Answer{text.size(), offset, text.substr(offset, kPiece)});
}

}  // namespace probebox::command
