#include "firmware/app/host/tls_door.hpp"

#include <chrono>
#include <utility>

#include "drivers/tls/connection.hpp"
#include "firmware/app/log/log.hpp"

namespace probebox::app {
namespace {

constexpr Nanoseconds kLookForNewKeys = std::chrono::minutes{1};
constexpr Nanoseconds kLookForKeys = std::chrono::seconds{5};

Outcome<tls::Context> contextOf(const board::TlsKeys& keys) {
  return tls::Context::load(tls::Side::box, {keys.certificate, keys.key, keys.people_ca}, keys.shut_out);
}

}  // namespace

std::optional<Error> whyNoKeys(const board::TlsKeys& keys) {
  if (const auto context = contextOf(keys); !context) return context.error();
  return std::nullopt;
}

void TlsDoor::advance(MonoTime now) {
  if (now < next_look_) return;
  auto context = contextOf(keys_);
  const auto problem = context ? std::string{} : context.error().what;
  if (!problem.empty() && problem != problem_) {
    logWarning("tls: " + problem + ". " +
               (context_ ? "The keys of before serve on." : "Until then nobody comes in through tls: links."));
  }
  if (context && !problem_.empty()) logInfo("tls: the keys are good now");
  problem_ = problem;
  if (context) context_ = std::move(*context);
  next_look_ = now + (problem.empty() ? kLookForNewKeys : kLookForKeys);
}

std::unique_ptr<io::BytePipe> TlsDoor::secure(std::unique_ptr<io::BytePipe> carrier) const {
  if (!context_) return nullptr;
  auto pipe = tls::accept(*context_, std::move(carrier));
  return pipe ? std::move(*pipe) : nullptr;
}

}  // namespace probebox::app
