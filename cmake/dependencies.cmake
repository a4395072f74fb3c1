# Packages only: nothing is downloaded at build time, no third-party source is copied in.
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(CLI11 2.1 REQUIRED)
pkg_check_modules(GPIOD REQUIRED IMPORTED_TARGET libgpiod>=2.1)
pkg_check_modules(USB REQUIRED IMPORTED_TARGET libusb-1.0>=1.0.26)
find_library(AIO_LIBRARY aio REQUIRED)  # libaio has no pkg-config file
pkg_check_modules(MD REQUIRED IMPORTED_TARGET libmd>=1.0)
pkg_check_modules(MODBUS REQUIRED IMPORTED_TARGET libmodbus>=3.1)
pkg_check_modules(SQLITE REQUIRED IMPORTED_TARGET sqlite3>=3.40)
pkg_check_modules(TOMLPP REQUIRED IMPORTED_TARGET tomlplusplus>=3.2)
pkg_check_modules(OPENSSL REQUIRED IMPORTED_TARGET libssl>=3.0 libcrypto>=3.0)
pkg_check_modules(SYSTEMD REQUIRED IMPORTED_TARGET libsystemd>=252)
pkg_check_modules(NCURSES REQUIRED IMPORTED_TARGET ncursesw>=6.3)
# Its macros (_DEFAULT_SOURCE, _XOPEN_SOURCE) are implied in C++, and what is precompiled without them serves nobody who has them.
set_target_properties(PkgConfig::NCURSES PROPERTIES INTERFACE_COMPILE_OPTIONS "")
# Debian compiles toml++ into a shared library; the header-only form asserts on some bytes.
target_compile_definitions(PkgConfig::TOMLPP INTERFACE TOML_HEADER_ONLY=0)
