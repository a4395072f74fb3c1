#include <string>
#include <utility>

#include "firmware/store/rows.hpp"
#include "firmware/store/store.hpp"

// How a result changes its state: PROPOSED -> ACCEPTED -> ACTIVE -> RETIRED, and back into force by a rollback.
namespace probebox::store {
namespace {

std::string which(const Record& record) {
  return "result " + std::to_string(record.id);
}

Failure notAcceptable(const Record& record) {
  if (record.state == State::refused) {
    return {Reason::not_possible_now, which(record) + " is a refusal (" + record.refusal()->name + ": " +
                                          record.refusal()->reason + "); calibrate again"};
  }
  const std::string what = which(record) + " is " + std::string{name(record.state)};
  const auto& subject = record.binding.subject;
  return {Reason::not_possible_now, what +
                                        ", and only a proposed one can be accepted; calibrate again, or undo the last "
                                        "change of what is in force about it: probebox rollback " +
                                        subject + " --by NAME"};
}

Failure notWaiting(const Record& record) {
  return {Reason::not_possible_now,
          which(record) + " is " + std::string{name(record.state)} + " and does not wait to come into force"};
}

std::optional<Failure> objectionTo(std::string_view what, std::string_view by, std::string_view utc) {
  if (by.empty()) return Failure{Reason::bad_argument, std::string{what} + " needs the name of the person who does it"};
  if (utc.empty()) return Failure{Reason::bad_argument, std::string{what} + " needs its time (UTC)"};
  return std::nullopt;
}

Outcome<void, Failure> retire(Database& database, Id id, std::string_view utc, std::string_view by) {
  TRY(note(database, id, State::retired, utc, by));
  Statement statement{database, "UPDATE results SET state = 3, retired_utc = ? WHERE id = ?"};
  const auto done = statement.bind(utc).bind(stored(id)).run();
  return done ? seal(database, id) : done;
}

// Whatever of the binding is in one of these states gives way.
Outcome<void, Failure> makeRoom(Database& database, const Binding& binding, std::string_view states,
                                std::string_view utc, std::string_view by) {
  Statement statement{database, select("WHERE state IN (").append(states).append(") AND ").append(kOfBinding)};
  TRY(const auto in_the_way, readRecords(bind(statement, binding)));
  for (const auto& record : in_the_way) {
    TRY(retire(database, record.id, utc, by));
  }
  return {};
}

Outcome<std::optional<Record>, Failure> waitingFor(Database& database, const Binding& binding) {
  Statement statement{database, select("WHERE state = 1 AND ").append(kOfBinding)};
  return readAtMostOne(bind(statement, binding));
}

Failure hasASuccessor(const Record& active, const Record& next) {
  const auto id = std::to_string(next.id);
  return {Reason::not_possible_now, "result " + std::to_string(active.id) + " is in force, and result " + id +
                                        " was accepted to take its place and waits: to keep the first, withdraw the "
                                        "other (probebox rollback " +
                                        id + " --by NAME)"};
}

Outcome<void, Failure> putIntoForce(Database& database, Id id, std::string_view utc, std::string_view by) {
  TRY(note(database, id, State::active, utc, by));
  Statement statement{database, "UPDATE results SET state = 2, retired_utc = '' WHERE id = ?"};
  const auto done = statement.bind(stored(id)).run();
  return done ? seal(database, id) : done;
}

Outcome<void, Failure> markAccepted(Database& database, Id id, std::string_view utc, std::string_view by,
                                    std::string_view remark) {
  TRY(note(database, id, State::accepted, utc, by, remark));
  Statement statement{database, "UPDATE results SET state = 1, accepted_utc = ?, accepted_by = ? WHERE id = ?"};
  const auto done = statement.bind(utc).bind(by).bind(stored(id)).run();
  return done ? seal(database, id) : done;
}

}  // namespace

Outcome<Record, Failure> Store::acceptNow(Id id, std::string_view by, std::string_view utc, Activation activation,
                                          std::string_view remark) {
  if (auto objection = objectionTo("an acceptance", by, utc)) return *objection;
  TRY(auto transaction, Transaction::begin(*database_));
  auto record = find(id);
  if (!record || record->state == State::accepted) return record;
  if (record->state == State::active) {
    TRY(const auto next, waitingFor(*database_, record->binding));
    if (next) return hasASuccessor(*record, *next);
    return record;
  }
  if (record->state != State::proposed) return notAcceptable(*record);
  const bool at_once = activation == Activation::at_once;
  TRY(makeRoom(*database_, record->binding, at_once ? "1, 2" : "1", utc, by));
  TRY(markAccepted(*database_, id, utc, by, remark));
  if (at_once) {
    TRY(putIntoForce(*database_, id, utc, by));
  }
  TRY(transaction.commit());
  record->state = at_once ? State::active : State::accepted;
  record->accepted_utc = utc;
  record->accepted_by = by;
  return record;
}

Outcome<Record, Failure> Store::activateNow(Id id, std::string_view utc) {
  if (utc.empty()) return Failure{Reason::bad_argument, "an activation needs its time (UTC)"};
  TRY(auto transaction, Transaction::begin(*database_));
  auto record = find(id);
  if (!record || record->state == State::active) return record;
  if (record->state != State::accepted) return notWaiting(*record);
  TRY(makeRoom(*database_, record->binding, "2", utc, record->accepted_by));
  TRY(putIntoForce(*database_, id, utc, record->accepted_by));
  TRY(transaction.commit());
  record->state = State::active;
  return record;
}

// Not one that was withdrawn before it was in force.
Outcome<std::optional<Record>, Failure> Store::retiredLastNow(const Binding& binding) {
  Statement statement{
      *database_,
      select("WHERE state = 3 AND ")
          .append(kOfBinding)
          .append(" AND EXISTS (SELECT 1 FROM transitions t WHERE t.result_id = results.id AND t.state = 2) "
                  "ORDER BY (SELECT max(t.id) FROM transitions t WHERE t.result_id = results.id) DESC "
                  "LIMIT 1")};
  return readAtMostOne(bind(statement, binding));
}

Outcome<RolledBack, Failure> Store::rollBackNow(const Binding& binding, std::string_view by, std::string_view utc) {
  if (auto objection = objectionTo("a rollback", by, utc)) return *objection;
  TRY(auto transaction, Transaction::begin(*database_));
  TRY(auto present, active(binding));
  TRY(auto before, retiredLastNow(binding));
  if (!present && !before) {
    return Failure{Reason::not_possible_now, "no result about '" + binding.subject +
                                                 "' has been in force before; there is no result to return to"};
  }
  if (present) {
    TRY(retire(*database_, present->id, utc, by));
    present->state = State::retired;
    present->retired_utc = utc;
  }
  if (before) {
    TRY(putIntoForce(*database_, before->id, utc, by));
    before->state = State::active;
    before->retired_utc.clear();
  }
  TRY(transaction.commit());
  return RolledBack{.retired = std::move(present), .active = std::move(before)};
}

Outcome<Record, Failure> Store::withdrawNow(Id id, std::string_view by, std::string_view utc) {
  if (auto objection = objectionTo("a withdrawal", by, utc)) return *objection;
  TRY(auto transaction, Transaction::begin(*database_));
  auto record = find(id);
  if (!record) return record;
  if (record->state != State::accepted) return notWaiting(*record);
  TRY(retire(*database_, id, utc, by));
  TRY(transaction.commit());
  record->state = State::retired;
  record->retired_utc = utc;
  return record;
}

Outcome<void, Failure> Store::takeBack(std::span<const Record> as_before) {
  TRY(auto transaction, Transaction::begin(*database_));
  for (const auto& record : as_before) {
    TRY(const auto now, find(record.id));
    if (now.state == record.state)
      return Failure{Reason::not_possible_now, which(now) + " is " + std::string{name(now.state)} + " already"};
    Statement newest{*database_,
                     "DELETE FROM transitions WHERE id = (SELECT max(id) FROM transitions WHERE result_id = ?)"};
    TRY(newest.bind(stored(record.id)).run());
    Statement row{*database_, "UPDATE results SET state = ?, retired_utc = ? WHERE id = ?"};
    TRY(row.bind(stored(record.state)).bind(record.retired_utc).bind(stored(record.id)).run());
    TRY(seal(*database_, record.id));
  }
  return transaction.commit();
}

// A row that is found damaged only now is set aside, and does not stand in the way of the others.

Outcome<Record, Failure> Store::accept(Id id, std::string_view by, std::string_view utc, Activation activation,
                                       std::string_view remark) {
  return withoutDamage([&] { return acceptNow(id, by, utc, activation, remark); });
}

Outcome<Record, Failure> Store::activate(Id id, std::string_view utc) {
  return withoutDamage([&] { return activateNow(id, utc); });
}

Outcome<RolledBack, Failure> Store::rollBack(const Binding& binding, std::string_view by, std::string_view utc) {
  return withoutDamage([&] { return rollBackNow(binding, by, utc); });
}

Outcome<std::optional<Record>, Failure> Store::retiredLast(const Binding& binding) {
  return withoutDamage([&] { return retiredLastNow(binding); });
}

Outcome<Record, Failure> Store::withdraw(Id id, std::string_view by, std::string_view utc) {
  return withoutDamage([&] { return withdrawNow(id, by, utc); });
}

}  // namespace probebox::store
