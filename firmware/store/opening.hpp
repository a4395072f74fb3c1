#pragma once
#include <memory>
#include <string>

#include "firmware/store/database.hpp"

namespace probebox::store {

struct Opened {
  std::unique_ptr<Database> database;
  std::string notice;
};

// See Store::open.
Outcome<Opened, Failure> openFile(const std::string& path);
// See Store::openAnyhow.
Opened openToReadAlone(const std::string& path, const Failure& why);

}  // namespace probebox::store
