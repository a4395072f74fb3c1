#pragma once
#include <optional>
#include <string>
#include <vector>

#include "firmware/results/decide.hpp"
#include "firmware/store/store.hpp"

// Changes of the results in a store as the box decides them: every value fits the box, and none differs.
namespace probebox::decided {

using store::Failure;
using store::Id;
using store::Record;
using store::Store;

results::Values plainValues(const store::Binding& here, std::function<std::shared_ptr<const Record>(Id)> record);

// waits: a cut is on.
Outcome<Record, Failure> accept(Store& store, Id id, const std::string& by, const std::string& utc, bool waits = false);
Outcome<Record, Failure> activate(Store& store, Id id, const std::string& utc);
Outcome<Record, Failure> withdraw(Store& store, Id id, const std::string& by, const std::string& utc);

// The result in force about the binding.
Outcome<std::optional<Record>, Failure> active(Store& store, const store::Binding& binding);
// Oldest first.
Outcome<std::vector<Record>, Failure> inState(Store& store, store::State state);
// In every state, newest first.
Outcome<std::vector<Record>, Failure> newest(Store& store, std::size_t count);

struct RolledBack {
  std::optional<Record> retired;
  std::optional<Record> active;
};
Outcome<RolledBack, Failure> rollBack(Store& store, const store::Binding& binding, const std::string& by,
                                      const std::string& utc);

}  // namespace probebox::decided
