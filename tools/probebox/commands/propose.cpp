#include <algorithm>
#include <optional>
#include <random>
#include <utility>
#include <variant>
#include <vector>

#include "protocol/messages/cases.hpp"
#include "tools/case/case_folder.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/kept_result.hpp"
#include "tools/probebox/link/box.hpp"

namespace probebox::command {
namespace {

using Piece = messages::ProposeCase::Request;

// Numbers of one request: it has to fit into a frame of 4096 bytes.
constexpr std::size_t kMostNumbers = 300;

messages::CaseEntry entryOf(const std::string& key, const metrology::Value& value) {
  using Kind = messages::CaseValue;
  messages::CaseEntry entry{.key = key, .kind = Kind::flag, .numbers = {}, .columns = 0, .text = {}};
  if (const auto* flag = std::get_if<bool>(&value)) {
    entry.numbers = {*flag ? 1.0 : 0.0};
  } else if (const auto* number = std::get_if<double>(&value)) {
    entry.kind = Kind::number;
    entry.numbers = {*number};
  } else if (const auto* text = std::get_if<std::string>(&value)) {
    entry.kind = Kind::text;
    entry.text = *text;
  } else if (const auto* numbers = std::get_if<std::vector<double>>(&value)) {
    entry.kind = Kind::numbers;
    entry.numbers = *numbers;
  } else {
    const auto& rows = std::get<metrology::Matrix>(value);
    entry.kind = Kind::matrix;
    entry.columns = static_cast<std::uint16_t>(rows.empty() ? 0 : rows.front().size());
    for (const auto& row : rows) entry.numbers.insert(entry.numbers.end(), row.begin(), row.end());
  }
  return entry;
}

// An entry is not cut into parts.
std::optional<Trouble> tooLong(const metrology::Dataset& dataset) {
  for (const auto& [key, value] : dataset.config) {
    const auto entry = entryOf(key, value);
    const auto bytes = entry.key.size() + entry.text.size() + sizeof(double) * entry.numbers.size();
    if (bytes > sizeof(double) * kMostNumbers)
      return Trouble{ExitStatus::failed, "too-long",
                     "The entry '" + key.substr(0, 60) + "' of config.json is too long for a request (" +
                         std::to_string(bytes) + " bytes, " + std::to_string(sizeof(double) * kMostNumbers) +
                         " fit): shorten it, or solve the case on this computer (probebox solve)."};
  }
  return std::nullopt;
}

// One entry, or one part of a column, a piece: each fits into a request by itself.
std::vector<Piece> piecesOf(const metrology::Dataset& dataset, const Propose& options) {
  std::vector<Piece> pieces{
      Piece{.number = 0, .first = true, .last = false, .method = dataset.method, .config = {}, .columns = {}}};
  for (const auto& [key, value] : dataset.config) pieces.emplace_back().config.push_back(entryOf(key, value));
  for (const auto& table : dataset.tables) {
    for (const auto& column : table.columns) {
      std::size_t at = 0;
      do {
        const auto from = column.values.begin() + static_cast<std::ptrdiff_t>(at);
        const auto count = std::min(kMostNumbers, column.values.size() - at);
        pieces.emplace_back().columns.push_back(
            {.table = table.name, .column = column.name, .values = {from, from + static_cast<std::ptrdiff_t>(count)}});
        at += count;
      } while (at < column.values.size());
    }
  }
  pieces.back().last = true;
  pieces.back().follow = true;
  pieces.back().as_this_machine = options.as_this_machine;
  pieces.back().by = options.by;
  const std::uint32_t number = std::random_device{}();
  for (auto& piece : pieces) piece.number = number;
  return pieces;
}

Trouble troubleOf(const casefolder::Problem& problem) {
  if (const auto* unreadable = std::get_if<casefolder::Unreadable>(&problem))
    return {ExitStatus::usage, "unreadable", unreadable->reason};
  const auto& refusal = std::get<casefolder::Unsupported>(problem).refusal;
  return {ExitStatus::failed, refusal.name, refusal.name + ": " + refusal.reason};
}

// Warnings that a person should read before accepting the result; none from a box that cannot show results.
std::vector<std::string> warningsOf(link::Client& box, const messages::ProposeCase::Answer& answer, Console& console) {
  if (!answer.refusal.empty()) return {};
  const auto kept = keptResult(box, console, answer.result_id);
  return kept && kept->result() != nullptr ? kept->result()->warnings : std::vector<std::string>{};
}

ExitStatus tell(const messages::ProposeCase::Answer& answer, const std::vector<std::string>& warnings,
                Console& console) {
  if (console.json())
    console.object(
        {{"result_id", answer.result_id}, {"refusal", answer.refusal}, {"also", answer.also}, {"warnings", warnings}});
  if (!answer.refusal.empty()) {
    if (!console.json())
      console.line("refused, and kept as " + std::to_string(answer.result_id) + "\n  " + answer.refusal);
    return ExitStatus::failed;
  }
  const auto id = std::to_string(answer.result_id);
  if (!console.json())
    console.line("result " + id + " is proposed; it has no effect until it is accepted: probebox accept " + id +
                 " --by NAME");
  for (const auto& warning : warnings) {
    if (!console.json()) console.line("  warning: " + warning);
  }
  for (const auto other : answer.also) {
    if (!console.json())
      console.line("so is result " + std::to_string(other) + ", about another subject of the same case");
  }
  return ExitStatus::ok;
}

// The box gives a case up by itself when nobody asks after it; asking it to do so now leaves no doubt.
Trouble givenUp(link::Client& box, std::uint32_t number) {
  const auto answer =
      box.request<messages::FollowCase>({.number = number, .cancel = true}, link::patience(kAnswerPatience));
  const bool stored = answer && answer->progress == messages::CaseProgress::done;
  auto trouble = interruption();
  if (stored)
    trouble.what += "; the box had solved the case before, and keeps it as " + std::to_string(answer->result_id);
  return trouble;
}

// Waits as long as the box says that it works: it knows its own limits.
Outcome<messages::ProposeCase::Answer, Trouble> follow(link::Client& box, std::uint32_t number, Console& console) {
  constexpr milliseconds kPause{300};
  while (true) {
    for (const auto pause = patienceOf(console, kPause); box.round(pause);) {
    }
    if (console.interrupted()) return givenUp(box, number);
    const auto answer = ask<messages::FollowCase>(box, console, {.number = number, .cancel = false});
    if (console.interrupted()) return givenUp(box, number);
    if (!answer) return answer.error();
    switch (answer->progress) {
      case messages::CaseProgress::working:
        console.progress("the box is solving the case, " + std::to_string(answer->elapsed_ms / 1000) + " s");
        continue;
      case messages::CaseProgress::done:
        return messages::ProposeCase::Answer{
            .result_id = answer->result_id, .refusal = answer->refusal, .working = false, .also = answer->also};
      case messages::CaseProgress::cancelled:
        break;
    }
    return Trouble{ExitStatus::box_refused, "cancelled", "the case was given up before the box had solved it"};
  }
}

}  // namespace

ExitStatus run(const Propose& options, const std::string& uri, Console& console) {
  const auto dataset = casefolder::readCase(options.input);
  if (!dataset) return console.fail(troubleOf(dataset.error()));
  if (const auto trouble = tooLong(*dataset)) return console.fail(*trouble);
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  messages::ProposeCase::Answer last;
  std::uint32_t number = 0;
  for (const auto& piece : piecesOf(*dataset, options)) {
    const auto answer = ask<messages::ProposeCase>(**box, console, piece);
    if (!answer) return console.fail(answer.error());
    last = *answer;
    number = piece.number;
  }
  if (last.working) {
    const auto followed = follow(**box, number, console);
    if (!followed) return console.fail(followed.error());
    last = *followed;
  }
  return tell(last, warningsOf(**box, last, console), console);
}

}  // namespace probebox::command
