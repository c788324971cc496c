#!/usr/bin/env node
// Reads every register of a Loopwarden map and prints it as JSON. Needs modbus-serial: npm install modbus-serial
// Usage: node this-file [HOST [PORT]]
const ModbusRTU = require("modbus-serial");

const HOST = @HOST@, PORT = @PORT@, UNIT = @UNIT@;
const WORD_ORDER = @ORDER@;
// [table, address, words, type, scale, name]
const REGISTERS = @REGISTERS@;

// The two registers of a 32-bit value, most significant byte first.
function inOrder(bytes) {
  const b = Buffer.from(bytes);
  if (WORD_ORDER === "badc" || WORD_ORDER === "dcba") b.swap16();
  if (WORD_ORDER === "cdab" || WORD_ORDER === "dcba") b.swap32().swap16();
  return b;
}

function decode(answer, type) {
  switch (type) {
    case "bit": return answer.data[0] ? 1 : 0;
    case "u16": return answer.buffer.readUInt16BE(0);
    case "i16": return answer.buffer.readInt16BE(0);
    case "u32": return inOrder(answer.buffer).readUInt32BE(0);
    default: return inOrder(answer.buffer).readFloatBE(0);
  }
}

async function main() {
  const client = new ModbusRTU();
  await client.connectTCP(process.argv[2] || HOST, { port: Number(process.argv[3] || PORT) });
  client.setID(UNIT);
  client.setTimeout(5000);
  const read = {
    "input register": (address, words) => client.readInputRegisters(address, words),
    "holding register": (address, words) => client.readHoldingRegisters(address, words),
    "discrete input": (address) => client.readDiscreteInputs(address, 1),
    coil: (address) => client.readCoils(address, 1),
  };
  const values = {};
  for (const [table, address, words, type, scale, name] of REGISTERS) {
    values[`${table}:${name}`] = decode(await read[table](address, words), type) * scale;
  }
  console.log(JSON.stringify(values, null, 1));
  client.close(() => {});
}

main().catch((error) => {
  console.error(error.message || error);
  process.exit(1);
});
