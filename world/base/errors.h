/// Errors as values, and checks for bugs. No exception leaves a module.
///
/// Result<T>  holds a value or an Error; the Error's message is one sentence for the user: what is wrong, where
///            (file, line or byte offset), what was expected, what to do.
/// CHECK      stops the program on a bug and prints the values. DCHECK does so in debug builds only.
#pragma once

#include <cstdlib>
#include <iostream>
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace world {

/// The numbers are the exit codes of the command line (design, section 7).
enum class ErrorKind : int { comparison = 1, usage = 2, input_output = 3, no_device = 4, unstable = 5 };

struct Error {
  ErrorKind kind = ErrorKind::input_output;
  std::string message;
};

inline Error input_error(std::string message) { return {ErrorKind::input_output, std::move(message)}; }
inline Error usage_error(std::string message) { return {ErrorKind::usage, std::move(message)}; }

template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }
  T& value() & { return require(), std::get<0>(state_); }
  const T& value() const& { return require(), std::get<0>(state_); }
  T&& value() && { return require(), std::get<0>(std::move(state_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  const Error& error() const { return std::get<1>(state_); }

 private:
  void require() const {
    if (!ok()) {
      std::cerr << "value of a failed result was read: " << std::get<1>(state_).message << '\n';
      std::abort();
    }
  }
  std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)) {}
  bool ok() const { return !error_; }
  explicit operator bool() const { return ok(); }
  const Error& error() const { return *error_; }

 private:
  std::optional<Error> error_;
};

using Status = Result<void>;

template <class A, class B>
[[noreturn]] void check_failed(const char* file, int line, const char* what, const A& a, const B& b) {
  std::cerr << file << ':' << line << ": check failed: " << what << " (" << a << " against " << b << ")\n";
  std::abort();
}

}  // namespace world

#define CHECK(condition)                                                              \
  do {                                                                                \
    if (!(condition)) {                                                               \
      std::cerr << __FILE__ << ':' << __LINE__ << ": check failed: " #condition "\n"; \
      std::abort();                                                                   \
    }                                                                                 \
  } while (0)
#define CHECK_OP_(a, op, b)                                                                                    \
  do {                                                                                                         \
    const auto& check_a = (a);                                                                                 \
    const auto& check_b = (b);                                                                                 \
    if (!(check_a op check_b)) ::world::check_failed(__FILE__, __LINE__, #a " " #op " " #b, check_a, check_b); \
  } while (0)
#define CHECK_EQ(a, b) CHECK_OP_(a, ==, b)
#define CHECK_LT(a, b) CHECK_OP_(a, <, b)
#define CHECK_LE(a, b) CHECK_OP_(a, <=, b)
#ifdef NDEBUG
#define DCHECK(condition) ((void)sizeof(!(condition)))
#else
#define DCHECK(condition) CHECK(condition)
#endif

/// TRY(name, expression): returns the error of `expression`, or declares `name` with its value.
#define LOAM_CONCAT_(a, b) a##b
#define LOAM_CONCAT(a, b) LOAM_CONCAT_(a, b)
#define TRY(declaration, expression)                                                       \
  auto LOAM_CONCAT(result_, __LINE__) = (expression);                                      \
  if (!LOAM_CONCAT(result_, __LINE__).ok()) return LOAM_CONCAT(result_, __LINE__).error(); \
  declaration = std::move(*LOAM_CONCAT(result_, __LINE__))
#define TRY_STATUS(expression)                       \
  do {                                               \
    auto try_status = (expression);                  \
    if (!try_status.ok()) return try_status.error(); \
  } while (0)
