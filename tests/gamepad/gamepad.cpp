/// A gamepad for machines that have none: preloaded before GLFW's library, it says what the file $LOAM_GAMEPAD holds,
/// lines of `b BUTTON 1` and `a AXIS VALUE` in GLFW's numbers. tests/tools/play/session.sh plays with it.
#include <GLFW/glfw3.h>

#include <cstdlib>
#include <fstream>

extern "C" {

int glfwJoystickIsGamepad(int joystick) { return joystick == GLFW_JOYSTICK_1; }

int glfwGetGamepadState(int joystick, GLFWgamepadstate* state) {
  if (joystick != GLFW_JOYSTICK_1) return GLFW_FALSE;
  *state = {};
  state->axes[GLFW_GAMEPAD_AXIS_LEFT_TRIGGER] = state->axes[GLFW_GAMEPAD_AXIS_RIGHT_TRIGGER] = -1;
  const char* path = std::getenv("LOAM_GAMEPAD");
  std::ifstream file(path ? path : "");
  char kind = 0;
  int number = 0;
  float value = 0;
  while (file >> kind >> number >> value) {
    if (kind == 'b' && number >= 0 && number <= GLFW_GAMEPAD_BUTTON_LAST) state->buttons[number] = value > 0;
    if (kind == 'a' && number >= 0 && number <= GLFW_GAMEPAD_AXIS_LAST) state->axes[number] = value;
  }
  return GLFW_TRUE;
}
}
