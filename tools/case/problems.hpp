#pragma once
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "tools/case/case_folder.hpp"

namespace probebox::casefolder {

// Collects what is wrong with a case folder, so that one reading names every problem.
class Problems {
 public:
  // No case: a file that cannot be read, or a configuration that names no method.
  void addUnreadable(std::string reason) { unreadable_.push_back(std::move(reason)); }
  // A case whose content supports no answer.
  void add(metrology::Refusal refusal) { refusals_.push_back(std::move(refusal)); }

  bool none() const { return unreadable_.empty() && refusals_.empty(); }
  // One problem a line, in the order of finding; of very many only the first. A refusal has the name of the first.
  Problem problem(const std::string& method) const;

 private:
  std::vector<std::string> unreadable_;
  std::vector<metrology::Refusal> refusals_;
};

}  // namespace probebox::casefolder
