#pragma once
#include <memory>
#include <optional>
#include <string>

#include "board/describe/service.hpp"
#include "drivers/io/byte_pipe.hpp"
#include "drivers/tls/context.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/time.hpp"

namespace probebox::app {

// Explains why the keys of tls: links cannot be used, file by file; nullopt where they can.
std::optional<Error> whyNoKeys(const board::TlsKeys& keys);

// The keys of tls: links. Files that change are taken without a restart; while new ones are not good, such as a
// certificate whose key has not been copied yet, the old ones serve on. Without good ones nobody comes in, and the box
// goes on without its door. One thread.
class TlsDoor {
 public:
  explicit TlsDoor(board::TlsKeys keys) : keys_{std::move(keys)} {}

  // Call every few milliseconds: looks at the files once a minute, and every few seconds until they are good. True
  // where the CA of people is another one than before: who is in came by one that does not count any more.
  bool advance(MonoTime now);
  // Why nobody comes in, or will not for long; empty while all is well.
  const std::string& problem() const { return problem_; }
  // Null without keys.
  std::unique_ptr<io::BytePipe> secure(std::unique_ptr<io::BytePipe> carrier) const;

 private:
  board::TlsKeys keys_;
  std::optional<tls::Context> context_;
  std::string people_ca_;  // its content
  std::string problem_;    // last reported; empty when there is none
  MonoTime next_look_{};
};

}  // namespace probebox::app
