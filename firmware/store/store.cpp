#include "firmware/store/store.hpp"

#include <array>
#include <utility>

#include "firmware/store/opening.hpp"
#include "firmware/store/result_json.hpp"

namespace probebox::store {
namespace {

constexpr std::string_view kSelect =
    "SELECT id, state, method, probe, machine, mounting, result_json, proposed_utc, accepted_utc, accepted_by, "
    "retired_utc FROM results ";

std::string select(std::string_view condition) {
  return std::string{kSelect}.append(condition);
}

std::int64_t stored(State state) {
  return static_cast<std::int64_t>(state);
}
std::int64_t stored(Id id) {
  return static_cast<std::int64_t>(id);
}

Failure unknown(Id id) {
  return {Reason::unknown_result,
          "there is no result " + std::to_string(id) + "; `probebox status` names the last one"};
}

Outcome<Record, Failure> readRecord(const Statement& row) {
  Record record{.id = static_cast<Id>(row.number(0)),
                .state = static_cast<State>(row.number(1)),
                .binding = {row.text(2), row.text(3), row.text(4), row.text(5)},
                .content = metrology::Refusal{},
                .proposed_utc = row.text(7),
                .accepted_utc = row.text(8),
                .accepted_by = row.text(9),
                .retired_utc = row.text(10)};
  const std::string json = row.text(6);
  const auto keep = [&](auto content) -> Outcome<Record, Failure> {
    if (!content) return Failure{Reason::damaged, "result " + std::to_string(record.id) + ": " + content.error().what};
    record.content = std::move(content).value();
    return std::move(record);
  };
  return record.state == State::refused ? keep(refusalFromJson(json)) : keep(resultFromJson(json));
}

Outcome<std::vector<Record>, Failure> readAll(Statement& statement) {
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

Outcome<Done, Failure> note(Database& database, Id id, State to, std::string_view utc, std::string_view by) {
  Statement statement{database, "INSERT INTO transitions (result_id, state, utc, by_whom) VALUES (?, ?, ?, ?)"};
  return statement.bind(stored(id)).bind(stored(to)).bind(utc).bind(by).run();
}

Outcome<Done, Failure> retireActive(Database& database, const Binding& binding, std::string_view utc,
                                    std::string_view by) {
  Statement noted{database,
                  "INSERT INTO transitions (result_id, state, utc, by_whom) SELECT id, 3, ?, ? FROM results "
                  "WHERE state = 2 AND method = ? AND probe = ? AND machine = ? AND mounting = ?"};
  const auto& [method, probe, machine, mounting] = binding;
  const auto written = noted.bind(utc).bind(by).bind(method).bind(probe).bind(machine).bind(mounting).run();
  if (!written) return written.error();
  Statement retired{database,
                    "UPDATE results SET state = 3, retired_utc = ? "
                    "WHERE state = 2 AND method = ? AND probe = ? AND machine = ? AND mounting = ?"};
  return retired.bind(utc).bind(method).bind(probe).bind(machine).bind(mounting).run();
}

Outcome<Done, Failure> activate(Database& database, Id id, std::string_view utc, std::string_view by) {
  if (const auto done = note(database, id, State::accepted, utc, by); !done) return done.error();
  if (const auto done = note(database, id, State::active, utc, by); !done) return done.error();
  Statement statement{database, "UPDATE results SET state = 2, accepted_utc = ?, accepted_by = ? WHERE id = ?"};
  return statement.bind(utc).bind(by).bind(stored(id)).run();
}

Failure notAcceptable(const Record& record) {
  const std::string which = "result " + std::to_string(record.id);
  if (record.state == State::refused) {
    return {Reason::not_possible_now, which + " is a refusal (" + record.refusal()->reason + "); calibrate again"};
  }
  return {Reason::not_possible_now, which + " is " + std::string{name(record.state)} +
                                        ", and only a proposed one can be accepted; calibrate again"};
}

}  // namespace

std::string_view name(State state) {
  constexpr std::array<std::string_view, 5> kNames{"proposed", "accepted", "active", "retired", "refused"};
  const auto index = static_cast<std::size_t>(state);
  return index < kNames.size() ? kNames[index] : "unknown";
}

Store::Store(std::unique_ptr<Database> database, std::string notice)
    : database_{std::move(database)}, notice_{std::move(notice)} {}
Store::Store(Store&&) noexcept = default;
Store& Store::operator=(Store&&) noexcept = default;
Store::~Store() = default;

Outcome<Store, Failure> Store::open(const std::string& path) {
  auto opened = openFile(path);
  if (!opened) return opened.error();
  return Store{std::move(opened->database), std::move(opened->notice)};
}

Outcome<Id, Failure> Store::insert(const Binding& binding, State state, std::string_view json, std::string_view dataset,
                                   std::string_view utc) {
  if (utc.empty()) return Failure{Reason::bad_argument, "a result needs the time at which it was found (UTC)"};
  auto transaction = Transaction::begin(*database_);
  if (!transaction) return transaction.error();
  Statement statement{*database_,
                      "INSERT INTO results (state, method, probe, machine, mounting, result_json, dataset_json, "
                      "proposed_utc) VALUES (?, ?, ?, ?, ?, ?, ?, ?)"};
  const auto& [method, probe, machine, mounting] = binding;
  statement.bind(stored(state)).bind(method).bind(probe).bind(machine).bind(mounting);
  if (const auto done = statement.bind(json).bind(dataset).bind(utc).run(); !done) return done.error();
  const auto id = static_cast<Id>(database_->lastId());
  if (const auto done = note(*database_, id, state, utc, ""); !done) return done.error();
  if (const auto done = transaction->commit(); !done) return done.error();
  return id;
}

Outcome<Id, Failure> Store::propose(const Binding& binding, const metrology::Result& result, std::string_view dataset,
                                    std::string_view utc) {
  return insert(binding, State::proposed, toJson(result), dataset, utc);
}

Outcome<Id, Failure> Store::refuse(const Binding& binding, const metrology::Refusal& refusal, std::string_view dataset,
                                   std::string_view utc) {
  return insert(binding, State::refused, toJson(refusal), dataset, utc);
}

Outcome<Record, Failure> Store::accept(Id id, std::string_view by, std::string_view utc) {
  if (by.empty()) return Failure{Reason::bad_argument, "an acceptance needs the name of the person who accepts"};
  if (utc.empty()) return Failure{Reason::bad_argument, "an acceptance needs its time (UTC)"};
  auto transaction = Transaction::begin(*database_);
  if (!transaction) return transaction.error();
  const auto record = find(id);
  if (!record || record->state == State::active) return record;
  if (record->state != State::proposed) return notAcceptable(*record);
  if (const auto done = retireActive(*database_, record->binding, utc, by); !done) return done.error();
  if (const auto done = activate(*database_, id, utc, by); !done) return done.error();
  if (const auto done = transaction->commit(); !done) return done.error();
  return find(id);
}

Outcome<Record, Failure> Store::find(Id id) {
  Statement statement{*database_, select("WHERE id = ?")};
  auto records = readAll(statement.bind(stored(id)));
  if (!records) return records.error();
  if (records->empty()) return unknown(id);
  return std::move(records->front());
}

Outcome<std::optional<Record>, Failure> Store::active(const Binding& binding) {
  Statement statement{*database_,
                      select("WHERE state = 2 AND method = ? AND probe = ? AND machine = ? AND mounting = ?")};
  const auto& [method, probe, machine, mounting] = binding;
  auto records = readAll(statement.bind(method).bind(probe).bind(machine).bind(mounting));
  if (!records) return records.error();
  if (records->empty()) return std::optional<Record>{};
  return std::optional<Record>{std::move(records->front())};
}

Outcome<std::vector<Record>, Failure> Store::newest(std::size_t count) {
  Statement statement{*database_, select("ORDER BY id DESC LIMIT ?")};
  return readAll(statement.bind(static_cast<std::int64_t>(count)));
}

Outcome<std::string, Failure> Store::dataset(Id id) {
  Statement statement{*database_, "SELECT dataset_json FROM results WHERE id = ?"};
  const auto row = statement.bind(stored(id)).step();
  if (!row) return row.error();
  if (!row.value()) return unknown(id);
  return statement.text(0);
}

Outcome<std::vector<Transition>, Failure> Store::history(Id id) {
  Statement statement{*database_, "SELECT state, utc, by_whom FROM transitions WHERE result_id = ? ORDER BY id"};
  statement.bind(stored(id));
  std::vector<Transition> transitions;
  while (true) {
    const auto row = statement.step();
    if (!row) return row.error();
    if (!row.value()) return transitions;
    transitions.push_back({id, static_cast<State>(statement.number(0)), statement.text(1), statement.text(2)});
  }
}

}  // namespace probebox::store
