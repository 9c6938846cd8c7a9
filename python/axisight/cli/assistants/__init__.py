"""The server ``axisight mcp``, which offers commands to assistants over the Model Context Protocol."""
