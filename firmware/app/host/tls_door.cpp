#include "firmware/app/host/tls_door.hpp"

#include <chrono>
#include <string>
#include <utility>

#include "board/describe/file_content.hpp"
#include "drivers/tls/connection.hpp"
#include "firmware/app/log/log.hpp"

namespace probebox::app {
namespace {

constexpr Nanoseconds kLookForNewKeys = std::chrono::minutes{1};
constexpr Nanoseconds kLookForKeys = std::chrono::seconds{5};

constexpr int kWarnDays = 30;
constexpr const char* kStill = ". The keys of before serve on.";
constexpr const char* kNobody = ". Until then nobody comes in through tls: links.";

// Empty where the certificate is valid for long; else another sentence every day.
std::string whyNotForLong(const tls::Context& context, const board::TlsKeys& keys) {
  if (context.daysLeft() >= kWarnDays) return {};
  return keys.certificate + " expires in " + std::to_string(context.daysLeft()) +
         " days: put the next one there (probebox-keys box SERIAL --renew).";
}

Outcome<tls::Context> contextOf(const board::TlsKeys& keys) {
  return tls::Context::load(tls::Side::box, {keys.certificate, keys.key, keys.people_ca}, keys.shut_out);
}

}  // namespace

std::optional<Error> whyNoKeys(const board::TlsKeys& keys) {
  if (const auto context = contextOf(keys); !context) return context.error();
  return std::nullopt;
}

bool TlsDoor::advance(MonoTime now) {
  if (now < next_look_) return false;
  auto context = contextOf(keys_);
  const auto problem = context ? whyNotForLong(*context, keys_) : context.error().what + (context_ ? kStill : kNobody);
  if (!problem.empty() && problem != problem_) logWarning("tls: " + problem);
  if (problem.empty() && !problem_.empty()) logInfo("tls: the keys are good now");
  problem_ = problem;
  next_look_ = now + (context ? kLookForNewKeys : kLookForKeys);
  if (!context) return false;
  context_ = std::move(*context);
  auto people_ca = board::fileContent(keys_.people_ca);
  if (!people_ca) return false;
  const auto before = std::exchange(people_ca_, std::move(*people_ca));
  return !before.empty() && before != people_ca_;
}

std::unique_ptr<io::BytePipe> TlsDoor::secure(std::unique_ptr<io::BytePipe> carrier) const {
  if (!context_) return nullptr;
  auto pipe = tls::accept(*context_, std::move(carrier));
  return pipe ? std::move(*pipe) : nullptr;
}

}  // namespace probebox::app
