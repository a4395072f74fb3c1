#pragma once
#include <array>
#include <cmath>
#include <cstddef>

// Vectors and matrices of three axes, as far as the emulated machine needs them.
namespace probebox::world {

using Vector3 = std::array<double, 3>;
using Matrix3 = std::array<Vector3, 3>;  // rows

constexpr Vector3 operator+(const Vector3& a, const Vector3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
constexpr Vector3 operator-(const Vector3& a, const Vector3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
constexpr Vector3 operator-(const Vector3& a) {
  return {-a[0], -a[1], -a[2]};
}
constexpr Vector3 operator*(double factor, const Vector3& a) {
  return {factor * a[0], factor * a[1], factor * a[2]};
}

constexpr double dot(const Vector3& a, const Vector3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline double norm(const Vector3& a) {
  return std::sqrt(dot(a, a));
}

// Unit vector; the zero vector for a zero vector.
inline Vector3 unit(const Vector3& a) {
  const double length = norm(a);
  return length > 0 ? (1 / length) * a : Vector3{};
}

constexpr Vector3 cross(const Vector3& a, const Vector3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

constexpr Vector3 operator*(const Matrix3& m, const Vector3& a) {
  return {dot(m[0], a), dot(m[1], a), dot(m[2], a)};
}

constexpr Matrix3 operator*(const Matrix3& a, const Matrix3& b) {
  Matrix3 product{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) product[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
  return product;
}

// Inverse of a matrix that is far from singular, such as a gain matrix.
constexpr Matrix3 inverse(const Matrix3& m) {
  const Vector3 a = cross(m[1], m[2]), b = cross(m[2], m[0]), c = cross(m[0], m[1]);
  const double scale = 1 / dot(m[0], a);
  return {{{scale * a[0], scale * b[0], scale * c[0]},
           {scale * a[1], scale * b[1], scale * c[1]},
           {scale * a[2], scale * b[2], scale * c[2]}}};
}

constexpr Matrix3 transposed(const Matrix3& m) {
  return {{{m[0][0], m[1][0], m[2][0]}, {m[0][1], m[1][1], m[2][1]}, {m[0][2], m[1][2], m[2][2]}}};
}

// Rotation by a right-handed angle about a unit vector (Rodrigues).
inline Matrix3 rotation(const Vector3& axis, double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad), v = 1 - c;
  const auto& [x, y, z] = axis;
  return {{{c + v * x * x, v * x * y - s * z, v * x * z + s * y},
           {v * x * y + s * z, c + v * y * y, v * y * z - s * x},
           {v * x * z - s * y, v * y * z + s * x, c + v * z * z}}};
}

}  // namespace probebox::world
