#include "firmware/app/solver/system_call_filter.hpp"

#include <array>
#include <cstddef>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>
#include <vector>

namespace probebox::app {
namespace {

#if defined(__x86_64__)
constexpr unsigned kMachine = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr unsigned kMachine = AUDIT_ARCH_AARCH64;
#elif defined(__arm__)
constexpr unsigned kMachine = AUDIT_ARCH_ARM;
#else
constexpr unsigned kMachine = 0;
#endif

// Names differ between processors: 32-bit ones have calls of their own for large files and times.
constexpr unsigned kAllowed[] = {
    SYS_read,
    SYS_write,
    SYS_close,
    SYS_lseek,
    SYS_munmap,
    SYS_mremap,
    SYS_brk,
    SYS_madvise,
    SYS_futex,
    SYS_getrandom,
    SYS_getpid,
    SYS_gettid,
    SYS_sched_yield,
    SYS_rt_sigaction,
    SYS_rt_sigprocmask,
    SYS_rt_sigreturn,
    SYS_restart_syscall,
    SYS_clock_gettime,
    SYS_fstat,
    SYS_exit,
    SYS_exit_group,
#ifdef SYS_newfstatat
    SYS_newfstatat,
#endif
#ifdef SYS_fstat64
    SYS_fstat64,
    SYS_fstatat64,
#endif
#ifdef SYS__llseek
    SYS__llseek,
#endif
#ifdef SYS_futex_time64
    SYS_futex_time64,
#endif
#ifdef SYS_clock_gettime64
    SYS_clock_gettime64,
#endif
#ifdef SYS_sigreturn
    SYS_sigreturn,
#endif
#ifdef __ARM_NR_set_tls
    __ARM_NR_set_tls,
    __ARM_NR_cacheflush,
#endif
};
// Allowed for memory without code: their third argument has no PROT_EXEC.
constexpr unsigned kAllowedForData[] = {
    SYS_mprotect,
#ifdef SYS_mmap
    SYS_mmap,
#endif
#ifdef SYS_mmap2
    SYS_mmap2,
#endif
};

constexpr std::size_t kProtection = 2;
// The lower half of an argument, which has all bits of a protection and of a process.
constexpr std::size_t argumentAt(std::size_t k) {
  constexpr bool kLittleEndian = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__;
  return offsetof(seccomp_data, args) + 8 * k + (kLittleEndian ? 0 : 4);
}

sock_filter load(std::size_t offset) {
  return BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<unsigned>(offset));
}
sock_filter end(unsigned action) {
  return BPF_STMT(BPF_RET | BPF_K, action);
}
// Skips the next `otherwise` instructions unless the loaded word is `value`.
sock_filter unless(unsigned value, unsigned char otherwise) {
  return BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, value, 0, otherwise);
}
sock_filter whereAnyBitOf(unsigned bits, unsigned char otherwise) {
  return BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, bits, 0, otherwise);
}

std::vector<sock_filter> program() {
  std::vector<sock_filter> steps{load(offsetof(seccomp_data, arch)), unless(kMachine, 1), BPF_STMT(BPF_JMP | BPF_JA, 1),
                                 end(SECCOMP_RET_KILL_PROCESS), load(offsetof(seccomp_data, nr))};
  for (const auto call : kAllowed) steps.insert(steps.end(), {unless(call, 1), end(SECCOMP_RET_ALLOW)});
  for (const auto call : kAllowedForData)
    steps.insert(steps.end(), {unless(call, 4), load(argumentAt(kProtection)), whereAnyBitOf(PROT_EXEC, 1),
                               end(SECCOMP_RET_KILL_PROCESS), end(SECCOMP_RET_ALLOW)});
  // abort() and raise() signal this process; the daemon has the same user.
  steps.insert(steps.end(), {unless(SYS_tgkill, 4), load(argumentAt(0)), unless(static_cast<unsigned>(getpid()), 1),
                             end(SECCOMP_RET_ALLOW), end(SECCOMP_RET_KILL_PROCESS)});
  steps.push_back(end(SECCOMP_RET_KILL_PROCESS));
  return steps;
}

}  // namespace

bool allowOnlyCalculation() {
  if (kMachine == 0) return false;
  auto steps = program();
  const sock_fprog filter{static_cast<unsigned short>(steps.size()), steps.data()};
  return prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) == 0;
}

}  // namespace probebox::app
