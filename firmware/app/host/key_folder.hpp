#pragma once
#include <filesystem>
#include <optional>

#include "board/describe/service.hpp"
#include "protocol/messages/unit.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Keys of tls: links that the box was provisioned with, in a folder of its state.
class KeyFolder {
 public:
  // state: folder for data that survive a restart.
  explicit KeyFolder(const std::filesystem::path& state) : folder_{state / "tls"} {}

  // `named` with the names of the files of this folder where it names none.
  board::TlsKeys in(board::TlsKeys named) const;
  // Whether these keys would let in other people than those that are there: whoever gives a box a CA can be anybody.
  bool haveOtherPeople(const messages::ProvisionKeys::Request& keys) const;
  // The keys are on the disk when this returns, all of them or none. Error: they do not belong together, have expired,
  // or the disk fails; with the remedy.
  std::optional<Error> write(const messages::ProvisionKeys::Request& keys) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace probebox::app
