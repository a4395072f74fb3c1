#pragma once
#include <string>

namespace probebox::store {

// Why a request to the store failed. The text names the file or result, and the remedy.
enum class Reason {
  unknown_result,    // no result of this id
  not_possible_now,  // the result's state does not allow it: a refusal cannot be accepted
  other_binding,     // the result holds for another probe, machine or mounting
  cut_is_on,         // nothing may come into force now
  differs,           // too far from the result in force, without although_it_differs
  bad_argument,      // an acceptance without a name, a stamp that is empty
  unavailable,       // locked, full, read-only, no permission: nothing was changed
  damaged,           // the file's content contradicts itself
  other_schema,      // written by another version of this program
  foreign_file,      // a database, but not one of ours
};

struct Failure {
  Reason reason{};
  std::string what;
};

}  // namespace probebox::store
