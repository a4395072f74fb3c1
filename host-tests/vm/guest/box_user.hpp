#pragma once
#include <sys/types.h>
#include <unistd.h>

namespace probebox::vm {

// Whom the box's programs run as in a guest, and who owns its devices: what a udev rule and a service unit arrange.
inline constexpr uid_t kBoxUser = 7627;
inline constexpr gid_t kBoxGroup = 7627;

// The whole process has the rights of the box's user for a while, and root's again afterwards.
class AsBoxUser {
 public:
  AsBoxUser() : taken_{setegid(kBoxGroup) == 0 && seteuid(kBoxUser) == 0} {}
  ~AsBoxUser() {
    if (seteuid(0) == 0 && setegid(0) == 0) return;
  }
  AsBoxUser(const AsBoxUser&) = delete;
  AsBoxUser& operator=(const AsBoxUser&) = delete;

  bool taken() const { return taken_; }

 private:
  bool taken_;
};

}  // namespace probebox::vm
