#include "firmware/app/solver/solver_child.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <linux/capability.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>
#include <utility>

#include "firmware/app/solver/system_call_filter.hpp"
#include "firmware/json/dataset_json.hpp"
#include "firmware/json/result_json.hpp"
#include "firmware/metrology/within_memory.hpp"

namespace probebox::app {
namespace {

constexpr std::string_view kResult = "result\n";
constexpr std::string_view kRefusal = "refusal\n";
constexpr int kPoliteness = 10;  // of nice(2): capture, links and lines to the CNC go first

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;  // reserves terabytes of addresses, and reads files at the end
#else
constexpr bool kSanitized = false;
#endif

std::string megabytes(std::size_t bytes) {
  return std::to_string(bytes >> 20U) + " MB";
}

// Keeps a limit that is lower already.
bool limit(decltype(RLIMIT_CPU) resource, rlim_t most) {
  rlimit before{};
  if (getrlimit(resource, &before) != 0) return false;
  const rlim_t least = std::min(most, before.rlim_max);
  const rlimit both{least, least};
  return setrlimit(resource, &both) == 0;
}

// Where the service manager has left none, it need not allow capset(2) either.
bool dropRights() {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, 2> held{};
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || syscall(SYS_capget, &header, held.data()) != 0) return false;
  const auto empty = [](const __user_cap_data_struct& sets) {
    return (sets.effective | sets.permitted | sets.inheritable) == 0;
  };
  if (std::all_of(held.begin(), held.end(), empty)) return true;
  held = {};
  return syscall(SYS_capset, &header, held.data()) == 0;
}

// Leaves no more files, processes, rights, system calls or core dumps than a calculation needs. Returns what could not
// be taken away; nullptr: nothing.
const char* confine(const SolverLimits& limits) {
  setpriority(PRIO_PROCESS, 0, kPoliteness);
  if (prctl(PR_SET_PDEATHSIG, SIGKILL) != 0) return "its life after the daemon's end";
  if (!dropRights()) return "its rights";
  // At the soft limit the signal ends the process and says why.
  const auto seconds = static_cast<rlim_t>(limits.processor.count());
  const rlimit processor{seconds, seconds + 1};
  if (setrlimit(RLIMIT_CPU, &processor) != 0) return "the processor";
  if (!limit(RLIMIT_CORE, 0)) return "core dumps";
  if (kSanitized) return nullptr;
  if (!limit(RLIMIT_AS, limits.memory_bytes)) return "memory";
  if (!limit(RLIMIT_NPROC, 0) || !limit(RLIMIT_NOFILE, 3) || !limit(RLIMIT_FSIZE, limits.answer_bytes))
    return "files and processes";
  return allowOnlyCalculation() ? nullptr : "system calls (its kernel has no seccomp filter)";
}

metrology::Refusal unconfined(const char* kept) {
  return {"solver-ended", std::string{"the box could not take from its solver "} + kept +
                              ", and solves nothing without: solve the case on a computer (probebox solve)"};
}

std::optional<std::string> readAll(int descriptor) {
  std::string text;
  std::array<char, 65536> part{};
  while (true) {
    const auto count = read(descriptor, part.data(), part.size());
    if (count < 0) return std::nullopt;
    if (count == 0) return text;
    text.append(part.data(), static_cast<std::size_t>(count));
  }
}

bool writeAll(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const auto count = write(descriptor, text.data(), text.size());
    if (count <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

metrology::Solved solved(const SolverLimits& limits) {
  const auto readAndSolve = []() -> metrology::Solved {
    const auto text = readAll(STDIN_FILENO);
    if (!text) return metrology::Refusal{"solver-ended", "the case could not be read by the solver: propose it again"};
    const auto dataset = json::datasetFromJson(*text);
    if (!dataset) return metrology::Refusal{"bad-config", dataset.error().what};
    return metrology::solve(*dataset);
  };
  return metrology::withinMemory(readAndSolve, tooMuchMemory(limits));
}

std::optional<SolverLimits> limitsFrom(std::string_view argument) {
  const auto comma = argument.find(',');
  if (comma == std::string_view::npos) return std::nullopt;
  const auto number = [](std::string_view text) -> std::optional<std::uint32_t> {
    std::uint32_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size() || value == 0) return std::nullopt;
    return value;
  };
  const auto seconds = number(argument.substr(0, comma));
  const auto memory = number(argument.substr(comma + 1));
  if (!seconds || !memory) return std::nullopt;
  SolverLimits limits;
  limits.processor = std::chrono::seconds{*seconds};
  limits.memory_bytes = std::size_t{*memory} << 20U;
  return limits;
}

}  // namespace

std::string toArgument(const SolverLimits& limits) {
  return std::to_string(limits.processor.count()) + "," + std::to_string(limits.memory_bytes >> 20U);
}

int solveInChild(std::string_view argument) {
  constexpr int kFailed = 1;
  constexpr int kUsage = 2;
  const auto limits = limitsFrom(argument);
  if (!limits) return kUsage;
  const char* kept = confine(*limits);
  return writeAll(STDOUT_FILENO, encodeAnswer(kept == nullptr ? solved(*limits) : unconfined(kept))) ? 0 : kFailed;
}

std::string encodeAnswer(const metrology::Solved& solved) {
  return solved ? std::string{kResult} + json::toJson(solved.value())
                : std::string{kRefusal} + json::toJson(solved.error());
}

Outcome<metrology::Solved> decodeAnswer(std::string_view text) {
  if (text.starts_with(kResult)) {
    TRY(auto result, json::resultFromJson(text.substr(kResult.size())));
    return metrology::Solved{std::move(result)};
  }
  if (text.starts_with(kRefusal)) {
    TRY(auto refusal, json::refusalFromJson(text.substr(kRefusal.size())));
    return metrology::Solved{std::move(refusal)};
  }
  return Error{"neither a result nor a refusal"};
}

metrology::Refusal tooLong(const SolverLimits& limits) {
  return {"too-long", "the case takes more than " + std::to_string(limits.processor.count()) +
                          " s of the box's processor: leave out readings, or solve it on a computer (probebox solve)"};
}

metrology::Refusal tooMuchMemory(const SolverLimits& limits) {
  return {"too-much-memory",
          "the case takes more than " + megabytes(limits.memory_bytes) +
              " of the box's memory: leave out readings, or solve it on a computer (probebox solve)"};
}

}  // namespace probebox::app
