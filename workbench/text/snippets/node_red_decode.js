// A block that was read becomes values by name: { "sp": 5, "set/sp": 5, ... }, the topic is its loop, or "box".
// What can be written has set/ before its name. All newest values are in the flow's context, "loopwarden".
const order = @ORDER@;
// [function, address, type, scale, loop, name]
const registers = @REGISTERS@;
const request = msg.input.payload; // of the block: fc, address, quantity
const words = (at) => msg.payload.slice(at, at + 2);

function wide(at) {
  const b = Buffer.alloc(4);
  words(at).forEach((word, i) => b.writeUInt16BE(word, 2 * i));
  if (order === "badc" || order === "dcba") b.swap16();
  if (order === "cdab" || order === "dcba") b.swap32().swap16();
  return b;
}

const decode = {
  bit: (at) => (msg.payload[at] ? 1 : 0),
  u16: (at) => msg.payload[at],
  i16: (at) => (msg.payload[at] << 16) >> 16,
  u32: (at) => wide(at).readUInt32BE(0),
  f32: (at) => wide(at).readFloatBE(0),
};

const values = {};
let loop = "box";
for (const [fc, address, type, scale, owner, name] of registers) {
  const at = address - Number(request.address);
  if (fc !== Number(request.fc) || at < 0 || at >= Number(request.quantity)) continue;
  const value = decode[type](at);
  values[name] = scale === 1 ? value : value * scale;
  loop = owner;
}
const all = flow.get("loopwarden") || {};
all[loop] = Object.assign(all[loop] || {}, values);
flow.set("loopwarden", all);
return { topic: loop, payload: values };
