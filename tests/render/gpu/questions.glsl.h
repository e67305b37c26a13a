// What the shaders that ask every member of a concept share: questions in, numbers out, 64 invocations a group.
// Include it once struct Question is there; an answer begins at answers[at].
layout(local_size_x = 64) in;
layout(binding = 0, std430) readonly buffer Questions { Question questions[]; };
layout(binding = 1, std430) writeonly buffer Answers { float answers[]; };

uint at;
void put(float value) { answers[at++] = value; }
void put(vec3 value) {
  put(value.x);
  put(value.y);
  put(value.z);
}
