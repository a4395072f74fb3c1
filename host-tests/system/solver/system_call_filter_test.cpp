#include "firmware/app/solver/system_call_filter.hpp"

#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <functional>
#include <gtest/gtest.h>
#include <new>
#include <stdexcept>
#include <string>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>
#include <vector>

namespace probebox::app {
namespace {

// In a process of its own, with the filter.
class SystemCallFilter : public testing::Test {
 protected:
  void SetUp() override {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "a sanitizer needs other system calls, and the solver has no filter under it";
#endif
    GTEST_FLAG_SET(death_test_style, "fast");
  }
  [[noreturn]] static void confined(const std::function<void()>& act) {
    constexpr int kNoFilter = 3;
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || !allowOnlyCalculation()) _exit(kNoFilter);
    act();
    _exit(0);
  }
  static void isKilled(const char* what, const std::function<void()>& by) {
    SCOPED_TRACE(what);
    EXPECT_EXIT(confined(by), testing::KilledBySignal(SIGSYS), "");
  }
};

TEST_F(SystemCallFilter, LetsACalculationAllocateThrowReadAndWrite) {
  EXPECT_EXIT(confined([] {
                std::vector<std::vector<double>> much(100);
                for (auto& part : much) part.resize(100'000, 1.5);
                try {
                  throw std::length_error{std::to_string(much[7][9])};
                } catch (const std::exception& error) {
                  if (write(STDERR_FILENO, error.what(), 3) != 3) _exit(4);
                }
                try {
                  const std::vector<char> too_much(std::size_t{1} << 60U);
                } catch (const std::bad_alloc&) {
                  char byte{};
                  if (read(STDIN_FILENO, &byte, 0) != 0) _exit(5);
                }
              }),
              testing::ExitedWithCode(0), "1.5");
}

TEST_F(SystemCallFilter, LetsItEndAsItDoesWithout) {
  EXPECT_EXIT(confined([] { std::exit(7); }), testing::ExitedWithCode(7), "");
  EXPECT_EXIT(confined([] { std::abort(); }), testing::KilledBySignal(SIGABRT), "");
  EXPECT_EXIT(confined([] { std::raise(SIGSEGV); }), testing::KilledBySignal(SIGSEGV), "");
}

TEST_F(SystemCallFilter, KillsItForEverythingElse) {
  isKilled("open", [] { open("/etc/hostname", O_RDONLY | O_CLOEXEC); });
  isKilled("unlink", [] { unlink("/nowhere"); });
  isKilled("socket", [] { socket(AF_UNIX, SOCK_STREAM, 0); });
  isKilled("fork", [] { fork(); });
  isKilled("exec", [] { execl("/bin/true", "true", nullptr); });
  isKilled("kill", [] { kill(getppid(), 0); });
  isKilled("tgkill", [] { syscall(SYS_tgkill, getppid(), getppid(), 0); });
  isKilled("ioctl", [] { isatty(0); });
  isKilled("prctl", [] { prctl(PR_SET_DUMPABLE, 1); });
  isKilled("memory with code", [] { mmap(nullptr, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0); });
  isKilled("data that becomes code", [] {
    void* page = mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    mprotect(page, 4096, PROT_READ | PROT_EXEC);
  });
}

}  // namespace
}  // namespace probebox::app
