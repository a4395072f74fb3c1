#include "firmware/app/results/acceptance.hpp"

namespace probebox::app {

std::string named(store::Id id) {
  return "Result " + std::to_string(id);
}

store::Failure tooFarApart(const store::Record& record, const Comparison& comparison) {
  return {store::Reason::differs, named(record.id) + " about " + record.binding.subject + " differs from result " +
                                      std::to_string(comparison.with) +
                                      ", which is in force: " + differencesIn(comparison) +
                                      ". Look for what has changed, or measure again; to accept it all the same say so "
                                      "(--although-it-differs)."};
}

std::vector<std::string> onRetired(store::Store& store, const store::Record& record) {
  std::vector<std::string> sentences;
  const auto others = store.restsOn(record.id);
  if (!others) return {named(record.id) + " may rest on a retired result: " + others.error().what};
  for (const auto& other : *others) {
    if (other.in_force) continue;
    sentences.push_back(named(record.id) + " about " + record.binding.subject + " rests on a retired result, " +
                        std::to_string(other.id) + " about " + other.subject + ": measure it again.");
  }
  return sentences;
}

}  // namespace probebox::app
