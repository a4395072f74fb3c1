#include "firmware/store/rows.hpp"

#include <utility>

#include "firmware/store/result_json.hpp"

namespace probebox::store {
namespace {

constexpr std::string_view kSelect =
    "SELECT id, state, method, subject, probe, machine, mounting, result_json, proposed_utc, accepted_utc, "
    "accepted_by, retired_utc FROM results ";

Outcome<Record, Failure> readRecord(const Statement& row) {
  Record record{.id = static_cast<Id>(row.number(0)),
                .state = static_cast<State>(row.number(1)),
                .method = row.text(2),
                .binding = {row.text(3), row.text(4), row.text(5), row.text(6)},
                .content = metrology::Refusal{},
                .proposed_utc = row.text(8),
                .accepted_utc = row.text(9),
                .accepted_by = row.text(10),
                .retired_utc = row.text(11)};
  const std::string json = row.text(7);
  const auto keep = [&](auto content) -> Outcome<Record, Failure> {
    if (!content) return Failure{Reason::damaged, "result " + std::to_string(record.id) + ": " + content.error().what};
    record.content = std::move(content).value();
    return std::move(record);
  };
  return record.state == State::refused ? keep(refusalFromJson(json)) : keep(resultFromJson(json));
}

}  // namespace

std::int64_t stored(State state) {
  return static_cast<std::int64_t>(state);
}
std::int64_t stored(Id id) {
  return static_cast<std::int64_t>(id);
}

std::string select(std::string_view condition) {
  return std::string{kSelect}.append(condition);
}

Outcome<std::vector<Record>, Failure> readRecords(Statement& statement) {
  std::vector<Record> records;
  while (true) {
    const auto row = statement.step();
    if (!row) return row.error();
    if (!row.value()) return records;
    auto record = readRecord(statement);
    if (!record) return record.error();
    records.push_back(std::move(record).value());
  }
}

Outcome<std::optional<Record>, Failure> readAtMostOne(Statement& statement) {
  auto records = readRecords(statement);
  if (!records) return records.error();
  if (records->empty()) return std::optional<Record>{};
  return std::optional<Record>{std::move(records->front())};
}

Statement& bind(Statement& statement, const Binding& binding) {
  const auto& [subject, probe, machine, mounting] = binding;
  return statement.bind(subject).bind(probe).bind(machine).bind(mounting);
}

Outcome<Done, Failure> note(Database& database, Id id, State to, std::string_view utc, std::string_view by) {
  Statement statement{database, "INSERT INTO transitions (result_id, state, utc, by_whom) VALUES (?, ?, ?, ?)"};
  return statement.bind(stored(id)).bind(stored(to)).bind(utc).bind(by).run();
}

}  // namespace probebox::store
