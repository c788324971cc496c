// Topic "FIC-101/sp" and a number become a request of modbus-flex-write. A 32-bit value goes as a whole, function 16.
const order = @ORDER@;
const unit = @UNIT@;
// name: [function, address, type, scale]
const writable = @WRITABLE@;
const found = writable[msg.topic];
if (!found) {
  node.error(`'${msg.topic}' can't be written`, msg);
  return null;
}
const [fc, address, type, scale] = found;
const number = Number(msg.payload);
if (!Number.isFinite(number)) {
  node.error(`'${msg.topic}' wants a number`, msg);
  return null;
}
const request = { fc, unitid: unit, address, quantity: 1 };
if (fc === 5) {
  request.value = number !== 0;
} else if (type === "f32") {
  const b = Buffer.alloc(4);
  b.writeFloatBE(number, 0);
  if (order === "cdab" || order === "dcba") b.swap16().swap32();
  if (order === "badc" || order === "dcba") b.swap16();
  request.value = [b.readUInt16BE(0), b.readUInt16BE(2)];
  request.quantity = 2;
} else {
  request.value = Math.round(number / scale) & 0xffff;
}
msg.payload = request;
return msg;
