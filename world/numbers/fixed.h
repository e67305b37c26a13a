/// Fixed point: I integer bits (the sign among them) and F bits of fraction in the smallest integer that holds them.
///
/// error  conversion rounds to nearest, ties away from zero: at most 2^-(F+1) inside the range. Sums and differences
///        are exact: a + b - b == a always, since overflow wraps. A product is rounded: at most 2^-(F+1).
/// fails  checked() and checked_add() return nothing outside the range; saturated() clamps, NaN becomes 0. Plain
///        operators wrap around, which is defined.
/// source Hughes and others. Computer Graphics: Principles and Practice, 3rd edition. 2013, section 14.3.1
#pragma once

#include <cmath>
#include <compare>
#include <cstdint>
#include <optional>
#include <type_traits>

namespace world {

template <int I, int F, bool kIsSigned = true>
struct Fixed {
  static constexpr int kBits = I + F;
  static_assert(I >= (kIsSigned ? 1 : 0) && F >= 0 && kBits >= 2 && kBits <= (kIsSigned ? 64 : 63));
  using Signed = std::conditional_t<
      (kBits <= 8), int8_t,
      std::conditional_t<(kBits <= 16), int16_t, std::conditional_t<(kBits <= 32), int32_t, int64_t>>>;
  using Code = std::conditional_t<kIsSigned, Signed, std::make_unsigned_t<Signed>>;
  using Wide = __int128;

  static constexpr Wide kMaxCode = (Wide{1} << (kIsSigned ? kBits - 1 : kBits)) - 1;
  static constexpr Wide kMinCode = kIsSigned ? -kMaxCode - 1 : Wide{0};
  static constexpr double kStep = 1.0 / static_cast<double>(Wide{1} << F);

  Code code = 0;  // the value times 2^F

  static constexpr Fixed from_code(Code c) { return {c}; }
  static constexpr Fixed max() { return {static_cast<Code>(kMaxCode)}; }
  static constexpr Fixed min() { return {static_cast<Code>(kMinCode)}; }

  /// The nearest value, or nothing where x is outside the range or not a number.
  static std::optional<Fixed> checked(double x) {
    const double scaled = std::round(x * static_cast<double>(Wide{1} << F));
    // Both bounds are powers of two, so that these comparisons are exact.
    if (!(scaled >= static_cast<double>(kMinCode) && scaled < static_cast<double>(kMaxCode + 1))) return std::nullopt;
    return Fixed{static_cast<Code>(scaled)};
  }
  static Fixed saturated(double x) {
    if (const auto inside = checked(x)) return *inside;
    return x > 0 ? max() : x < 0 ? min() : Fixed{};
  }
  /// Exact up to 53 bits, else rounded to nearest.
  constexpr double value() const { return static_cast<double>(code) * kStep; }

  friend constexpr Fixed operator+(Fixed a, Fixed b) { return wrapped(Wide{a.code} + b.code); }
  friend constexpr Fixed operator-(Fixed a, Fixed b) { return wrapped(Wide{a.code} - b.code); }
  friend constexpr Fixed operator-(Fixed a) { return wrapped(-Wide{a.code}); }
  friend constexpr Fixed operator*(Fixed a, Fixed b) { return wrapped(rounded_product(a, b)); }
  friend constexpr auto operator<=>(Fixed, Fixed) = default;

  static constexpr std::optional<Fixed> checked_add(Fixed a, Fixed b) { return in_range(Wide{a.code} + b.code); }
  static constexpr std::optional<Fixed> checked_subtract(Fixed a, Fixed b) { return in_range(Wide{a.code} - b.code); }
  static constexpr std::optional<Fixed> checked_multiply(Fixed a, Fixed b) { return in_range(rounded_product(a, b)); }

 private:
  /// Halves go up, towards +infinity. The product of two codes plus a half fits into 128 bits.
  static constexpr Wide rounded_product(Fixed a, Fixed b) {
    const Wide product = Wide{a.code} * Wide{b.code};
    if constexpr (F == 0)
      return product;
    else
      return (product + (Wide{1} << (F - 1))) >> F;
  }
  static constexpr std::optional<Fixed> in_range(Wide code) {
    if (code < kMinCode || code > kMaxCode) return std::nullopt;
    return Fixed{static_cast<Code>(code)};
  }
  /// Modulo 2^kBits, with the sign of the top bit.
  static constexpr Fixed wrapped(Wide code) {
    using Bits = unsigned __int128;
    const Bits low = static_cast<Bits>(code) & ((Bits{1} << kBits) - 1);
    const bool negative = kIsSigned && (low >> (kBits - 1) & 1);
    return Fixed{static_cast<Code>(negative ? static_cast<Wide>(low) - (Wide{1} << kBits) : static_cast<Wide>(low))};
  }
};

template <int I, int F>
using UFixed = Fixed<I, F, false>;

}  // namespace world
